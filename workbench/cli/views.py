"""The views of a run: recording, report and picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from workbench.bundle import Bundle
from workbench.catalogue import describe
from workbench.cli.console import progress, stderr
from workbench.errors import WorkbenchError
from workbench.progress import Progress

if TYPE_CHECKING:
    from PIL.Image import Image

    from workbench.report import ComparisonSet

__all__ = ["bundle_json", "draw_views", "picture_of"]


def draw_views(bundle: Bundle, progress: Progress) -> list[str]:
    """Draw recording and report into a sealed bundle; print, and return, what could not be drawn.

    Whatever keeps them from being drawn changes neither the run's status nor the exit code.
    """
    from workbench.report import write_views  # not needed by the run itself

    progress("views")
    undrawn = write_views(bundle)
    if undrawn is None:
        return []
    stderr.print(undrawn, style="bold", markup=False)
    return [undrawn]


def bundle_json(bundle: Bundle, undrawn: list[str]) -> dict[str, Any]:
    """Return a bundle's JSON object, with what could not be drawn among its warnings."""
    found = describe(bundle)
    return found | {"warnings": [*found["warnings"], *undrawn]}


def picture_of(shown: ComparisonSet) -> Image | None:
    """Return a picture for a page, None where this computer cannot take one."""
    progress("picture of the viewer")
    try:
        return shown.picture()
    except WorkbenchError as error:
        stderr.print(f"the page has no picture of the viewer: {error}", markup=False)
        return None
