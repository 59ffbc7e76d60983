"""The views of a run that was carried out, drawn once its bundle is sealed."""

from __future__ import annotations

from typing import Any

from workbench.bundle import Bundle
from workbench.catalogue import describe
from workbench.cli.output import people
from workbench.progress import Progress

__all__ = ["described", "draw_views"]


def draw_views(bundle: Bundle, progress: Progress) -> list[str]:
    """Draw recording and report into a sealed bundle; print, and return, what could not be drawn.

    Whatever keeps them from being drawn changes neither the run's status nor the exit code.
    """
    from workbench.comparison_set import write_views  # a run itself is carried out without

    progress("views")
    undrawn = write_views(bundle)
    if undrawn is None:
        return []
    people.print(undrawn, style="bold", markup=False)
    return [undrawn]


def described(bundle: Bundle, undrawn: list[str]) -> dict[str, Any]:
    """Return a bundle's JSON object, with what could not be drawn among its warnings."""
    found = describe(bundle)
    return found | {"warnings": [*found["warnings"], *undrawn]}
