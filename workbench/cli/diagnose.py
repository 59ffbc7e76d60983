"""`workbench diagnose`: what the model gets wrong, and the model that does not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from workbench import review as views
from workbench.bundle import Bundle, runs_named
from workbench.cli.output import RUNS_MEANT, JsonFlag, RunsFolder, emit, people, tell
from workbench.cli.showing import picture_of, show_diagnosis, show_next
from workbench.comparison_set import ComparisonSet, compare_extended
from workbench.diagnose import (
    Diagnosis,
    Rig,
    diagnose_into,
    load_mechanism,
    refused,
    replay_of,
    robot_of,
)
from workbench.errors import DataFault, InputError
from workbench.load_run import load_any
from workbench.protocol import load_model

__all__ = ["diagnose"]


def diagnose(
    runs: Annotated[list[Path] | None, RUNS_MEANT] = None,
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

    def moving(found: Diagnosis) -> bytes | None:
        return _moving(found, bundles) if picture and bundles else None

    try:
        done = diagnose_into(out, given, files, bundles, tell, look_ahead, moving)
    except DataFault as fault:
        _refuse(fault, as_json)
        return
    if as_json:
        emit(done.as_json())
        return
    show_diagnosis(done.found)
    show_next(done.found, done.proposed)
    people.print(f"report: {done.report}", markup=False)


def _refuse(fault: DataFault, as_json: bool) -> None:
    """Answer that the data are at fault, where nothing could be fitted."""
    if as_json:
        emit(refused(fault))
        return
    people.print(f"DATA_FAULT: {fault}", markup=False)


def _moving(found: Diagnosis, bundles: Sequence[Bundle]) -> bytes | None:
    """Return a JPEG of the viewer with the run that the base misses most, None where it cannot."""
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
    """Return the rig that a file describes, or the robot that made the runs; data; bundles."""
    if file is not None and runs:
        raise InputError(f"{file} names its own runs; give either RUNS or --rig")
    if file is not None:
        described = load_mechanism(file)
        return described, dict(described.files), []
    if not runs:
        raise InputError("nothing to diagnose: give RUNS, or --rig with a rig file")
    bundles = [Bundle.open(one) for one in runs_named(runs, folder)]
    return *robot_of(bundles, tell), bundles
