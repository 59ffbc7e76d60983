"""What a diagnosis leaves in its folder: the answer, and the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from workbench.bundle import Bundle
from workbench.diagnose.compared import write_compared
from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.kept import write_answer
from workbench.diagnose.next_protocol import Following, next_object
from workbench.diagnose.report import write_diagnosis
from workbench.versions import versions

__all__ = ["write_report"]


def write_report(
    folder: Path,
    found: Diagnosis,
    files: Mapping[str, Path],
    proposed: Following | None,
    moving: bytes | None = None,
    bundles: Sequence[Bundle] = (),
) -> Path:
    """Write answer and page of a diagnosis into its folder and return the page's path.

    Args:
        folder: of the diagnosis; the files bear its name.
        found: the answer.
        files: what it was made from.
        proposed: what is to be run next.
        moving: a JPEG of the viewer with a run, for the page.
        bundles: of the runs; none of another rig.
    """
    next_run = None
    if proposed is not None:
        next_run = f"{proposed.sentence}: workbench run {proposed.protocol.path}"
    write_compared(folder, found)
    write_answer(folder / f"{folder.name}.json", found, files, next_object(proposed))
    page = folder / f"{folder.name}.html"
    return write_diagnosis(page, found, files, versions(), next_run, moving,
                           {one.path.name: one.path for one in bundles})  # fmt: skip
