"""A diagnosis with all that it leaves in its folder: model, next protocol, answer and page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path

from workbench.bundle import Bundle
from workbench.diagnose import Diagnosis, Rig, diagnose, write_answer
from workbench.investigate import Diagnosed, Following, following, next_object
from workbench.progress import Progress, Stage, portion
from workbench.report.diagnosis.compared import write_compared
from workbench.report.diagnosis.page import write_diagnosis
from workbench.versions import versions

__all__ = ["diagnose_into", "write_report"]


def diagnose_into(
    out: Path | None,
    rig: Rig,
    files: Mapping[str, Path],
    bundles: Sequence[Bundle] = (),
    progress: Progress = lambda text: None,
    look_ahead: bool = True,
    moving: Callable[[Diagnosis], bytes | None] = lambda found: None,
) -> Diagnosed:
    """Diagnose a rig, propose what to run next, and write all of it into a folder.

    Args:
        out: folder of the diagnosis; by default `diagnoses/TIME`. The files bear its name.
        rig: with its runs.
        files: what it is made from.
        bundles: of the runs; those that are not in `files` were left out, and without any nothing
            is proposed.
        progress: called at each stage.
        look_ahead: whether to look for the runs that would show more.
        moving: draws a JPEG of the viewer with a run, for the page.

    Raises:
        InputError, DataFault: as `diagnose`.
    """
    folder = out or Path("diagnoses") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
    bundles = [one for one in bundles if one.path.name in files]
    look_ahead = look_ahead and bool(bundles)
    found = diagnose(rig, folder, folder.name, portion(progress, 0.0, 0.7 if look_ahead else 0.95))
    ahead = portion(progress, 0.7, 0.95)
    proposed = following(found, bundles, folder, folder.name, ahead) if look_ahead else None
    picture = moving(found)
    progress(Stage("draw the page", 0.95))
    return Diagnosed(
        found, proposed, write_report(folder, found, files, proposed, picture, bundles)
    )


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
    write_answer(folder / f"{folder.name}.json", found.as_json(), files, next_object(proposed))
    page = folder / f"{folder.name}.html"
    return write_diagnosis(page, found, files, versions(), next_run, moving,
                           {one.path.name: one.path for one in bundles})  # fmt: skip
