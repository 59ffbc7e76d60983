"""`workbench diagnose`: what the model gets wrong, and the model that does not."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle
from workbench.cli.identify import same_robot
from workbench.cli.output import JsonFlag, RunsFolder, emit, people, show_table, tell
from workbench.diagnose import Diagnosis, HopperRig, load_rig, refused, write_diagnosis
from workbench.diagnose import diagnose as diagnose_rig
from workbench.diagnose.rig import Rig
from workbench.engine import versions
from workbench.errors import DataFault, InputError
from workbench.identify import measured_run

__all__ = ["diagnose"]


def diagnose(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="RUNS...", help="Bundles, or folders that hold some."),
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file of another system; it names its own runs.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the answer; by default diagnoses/<time>.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all draws: the same seed, the same answer.")] = 0,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Find what the simulation gets wrong in runs, name the cause, write the extended model.

    Runs with role train are fitted, those held out judge: clamped sweeps and ring-downs tell of
    the beam, hops and drops of the ground.

    Example: workbench diagnose runs --out diagnoses/april
    """
    target = out or Path("diagnoses") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
    given, files = _rig(runs or [], rig, folder)
    try:
        found = diagnose_rig(given, target, target.name, tell, seed)
    except DataFault as fault:
        _refuse(fault, as_json)
        return
    report = write_diagnosis(target / f"{target.name}.html", found, files, versions())
    if as_json:
        emit(found.as_json() | {"report": str(report)})
        return
    _print(found)
    people.print(f"report: {report}", markup=False)


def _refuse(fault: DataFault, as_json: bool) -> None:
    """Answer that the data are at fault, where nothing could be fitted."""
    if as_json:
        emit(refused(fault))
        return
    people.print(f"DATA_FAULT: {fault}", markup=False)


def _rig(runs: list[Path], file: Path | None, folder: Path) -> tuple[Rig, dict[str, Path]]:
    """Return the rig that a file describes, or the robot that made the runs, and their data."""
    if file is not None and runs:
        raise InputError(f"{file} names its own runs; give either RUNS or --rig")
    if file is not None:
        described = load_rig(file)
        return described, described.files
    if not runs:
        raise InputError("nothing to diagnose: give RUNS, or --rig with a rig file")
    bundles = Bundle.find_all(runs, folder)
    stated, shape = same_robot(bundles)
    files = {"shape": shape.path} | {bundle.path.name: bundle.take() for bundle in bundles}
    return HopperRig([measured_run(bundle) for bundle in bundles], stated, shape.content), files


def _print(found: Diagnosis) -> None:
    answer, told = found.answer, found.as_json()["rmse_mm"]
    people.print(f"{answer.kind}: {answer.reason}", markup=False)
    for cause in answer.causes:
        people.print(
            f"  {cause} ({100 * answer.confidence.get(cause, 0.0):.0f} %): "
            f"{found.sentence(cause)}", markup=False,
        )  # fmt: skip
    rows = [[key.replace("_", " "), f"{value:.3f}"] for key, value in told.items()]
    show_table(
        f"error on {', '.join(found.held_out)}", ["model", f"rmse [{found.errors.unit}]"], rows
    )
    if found.extended is not None:
        people.print(
            f"the extension removes {100 * found.removed:.0f} % of the removable error\n"
            f"extended model: {found.extended.source}", markup=False,
        )  # fmt: skip
    if answer.rivals:
        show_table("not taken", ["cause", "why"], [[r.name, r.why_not] for r in answer.rivals])
