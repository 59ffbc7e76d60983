"""`workbench diagnose`: name what the model gets wrong, and write the extended model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from workbench import report as views
from workbench.bundle import Bundle, runs_named
from workbench.cli.console import progress, stderr
from workbench.cli.diagnosis_output import show_diagnosis, show_next
from workbench.cli.plain_output import RUNS_ARGUMENT, JsonFlag, RunsFolder, emit
from workbench.cli.views import picture_of
from workbench.data_quality import refused
from workbench.diagnose import Diagnosis, Rig, robot_of
from workbench.errors import DataFault, InputError
from workbench.mechanism import load_mechanism
from workbench.report import ComparisonSet, compare_extended, diagnose_into, load_any, replay_of
from workbench.schemas import load_model

__all__ = ["diagnose"]


def diagnose(
    runs: Annotated[list[Path] | None, RUNS_ARGUMENT] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file of another system; it names its own runs.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the answer; by default diagnoses/TIME.")
    ] = None,
    look_ahead: Annotated[
        bool, typer.Option("--next/--no-next", help="Look for the runs that would show more.")
    ] = True,
    picture: Annotated[
        bool, typer.Option(help="Show the viewer with the worst run in the report.")
    ] = True,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Find what the simulation gets wrong in runs, name the cause, write the extended model.

    Runs with role train are fitted, those held out judge: clamped sweeps and ring-downs show
    the beam, hops and drops the ground. Where several causes remain, or some could not be seen, the
    runs that would show them best are written as a protocol, OUT/NAME-next.yaml.

    Example: workbench diagnose runs --out diagnoses/april
    """
    given, files, bundles = _rig(runs or [], rig, folder)

    def worst_run(found: Diagnosis) -> bytes | None:
        return _picture(found, bundles) if picture and bundles else None

    try:
        done = diagnose_into(out, given, files, bundles, progress, look_ahead, worst_run)
    except DataFault as fault:
        _refuse(fault, as_json)
        return
    if as_json:
        emit(done.as_json())
        return
    show_diagnosis(done.found)
    show_next(done.found, done.proposed)
    stderr.print(f"report: {done.report}", markup=False)


def _refuse(fault: DataFault, as_json: bool) -> None:
    """Report that the data are at fault, where nothing could be fitted."""
    if as_json:
        emit(refused(fault))
        return
    stderr.print(f"DATA_FAULT: {fault}", markup=False)


def _picture(found: Diagnosis, bundles: Sequence[Bundle]) -> bytes | None:
    """Return a JPEG of the viewer with the run that the nominal model fits worst, or None."""
    worst = next(one for one in bundles if one.path.name == found.worst_held_out)
    if found.extended is None:
        shown = load_any(worst)
    else:
        model = load_model(str(found.extended.source), Path())
        shown = compare_extended(worst, model, replay_of(found, worst.path.name))
    image = picture_of(ComparisonSet([worst], [shown]))
    return None if image is None else views.as_jpeg(image)


def _rig(
    runs: list[Path], file: Path | None, folder: Path
) -> tuple[Rig, dict[str, Path], list[Bundle]]:
    """Return the rig of a file or of the robot that made the runs, its data files, bundles."""
    if file is not None and runs:
        raise InputError(f"{file} names its own runs; give either RUNS or --rig")
    if file is not None:
        rig = load_mechanism(file)
        return rig, dict(rig.files), []
    if not runs:
        raise InputError("nothing to diagnose: give RUNS, or --rig with a rig file")
    bundles = [Bundle.open(one) for one in runs_named(runs, folder)]
    return *robot_of(bundles, progress), bundles
