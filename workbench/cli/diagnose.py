"""`workbench diagnose`: what the model gets wrong, and the model that does not."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench import review as views
from workbench.bundle import Bundle
from workbench.cli.completing import run_names
from workbench.cli.identify import read_runs, same_robot
from workbench.cli.output import JsonFlag, RunsFolder, emit, people, show_table, tell
from workbench.cli.review import picture_of
from workbench.diagnose import (
    Diagnosis,
    Following,
    HopperRig,
    Rig,
    following,
    load_mechanism,
    refused,
    write_answer,
    write_diagnosis,
)
from workbench.diagnose import diagnose as diagnose_rig
from workbench.errors import DataFault, InputError
from workbench.protocol import load_model
from workbench.recall import recall_whatever
from workbench.showing import Shown, pair_extended
from workbench.versions import versions

__all__ = ["diagnose", "next_object", "robot_of", "show_diagnosis", "show_next", "write_report"]


def diagnose(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RUNS...", help="Bundles, or folders that hold some.", autocompletion=run_names
        ),
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file of another system; it names its own runs.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the answer; by default diagnoses/<time>.")
    ] = None,
    look_ahead: Annotated[
        bool, typer.Option("--next/--no-next", help="Look for the runs that would tell more.")
    ] = True,
    picture: Annotated[
        bool, typer.Option(help="Show the viewer with the worst run in the report.")
    ] = True,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Find what the simulation gets wrong in runs, name the cause, write the extended model.

    Runs with role train are fitted, those held out judge: clamped sweeps and ring-downs tell of
    the beam, hops and drops of the ground. Where they leave several causes, or could not show some,
    the runs that would tell best are written as a protocol, OUT/<name>-next.yaml.

    Example: workbench diagnose runs --out diagnoses/april
    """
    target = out or Path("diagnoses") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
    given, files, bundles = _rig(runs or [], rig, folder)
    try:
        found = diagnose_rig(given, target, target.name, tell)
    except DataFault as fault:
        _refuse(fault, as_json)
        return
    look_ahead = look_ahead and bool(bundles)
    proposed = following(found, bundles, target, target.name, tell) if look_ahead else None
    moving = _moving(found, bundles) if picture and bundles else None
    page = write_report(target, found, files, proposed, moving)
    if as_json:
        emit(found.as_json() | next_object(proposed) | {"report": str(page)})
        return
    show_diagnosis(found)
    show_next(found, proposed)
    people.print(f"report: {page}", markup=False)


def _refuse(fault: DataFault, as_json: bool) -> None:
    """Answer that the data are at fault, where nothing could be fitted."""
    if as_json:
        emit(refused(fault))
        return
    people.print(f"DATA_FAULT: {fault}", markup=False)


def next_object(proposed: Following | None) -> dict[str, Any]:
    """Return what the command line's object says of the next experiment."""
    if proposed is None:
        return {"next_protocol": None, "next_experiment": None}
    told = proposed.proposal.as_json()
    return {"next_protocol": str(proposed.protocol.path), "next_experiment": told}


def _moving(found: Diagnosis, bundles: Sequence[Bundle]) -> bytes | None:
    """Return a JPEG of the viewer with the run that the base misses most, None where it cannot."""
    worst = next(one for one in bundles if one.path.name == found.worst_held_out)
    if found.extended is None:
        shown = recall_whatever(worst)
    else:
        shown = pair_extended(worst, load_model(str(found.extended.source), Path()))
    image = picture_of(Shown([worst], [shown]))
    return None if image is None else views.as_jpeg(image)


def write_report(
    folder: Path,
    found: Diagnosis,
    files: dict[str, Path],
    proposed: Following | None,
    moving: bytes | None = None,
) -> Path:
    """Write answer and page of a diagnosis into its folder and return the page's path."""
    next_run = None
    if proposed is not None:
        next_run = f"{proposed.sentence}: workbench run {proposed.protocol.path}"
    write_answer(folder / f"{folder.name}.json", found, files)
    page = folder / f"{folder.name}.html"
    return write_diagnosis(page, found, files, versions(), next_run, moving)


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
    bundles = Bundle.find_all(runs, folder)
    return *robot_of(bundles), bundles


def robot_of(bundles: Sequence[Bundle]) -> tuple[HopperRig, dict[str, Path]]:
    """Return the robot that made some runs, and the files that it is known from."""
    stated, shape = same_robot(bundles)
    files = {"shape": shape.path} | {bundle.path.name: bundle.take() for bundle in bundles}
    return HopperRig(read_runs(bundles), stated, shape.content), files


def show_next(found: Diagnosis, proposed: Following | None) -> None:
    """Print what to run next; where a set stays and no run parts it, what else would."""
    if proposed is not None:
        people.print(
            f"next: {proposed.sentence}\n      workbench run {proposed.protocol.path}", markup=False
        )
    elif found.kind == "SET":
        people.print("no run on the menu tells these apart; what would:", markup=False)
        for cause in found.causes:
            people.print(f"  {cause.name}: {cause.separated_by or 'nothing known'}", markup=False)


def show_diagnosis(found: Diagnosis) -> None:
    """Print the answer, its proof, what the refit changed and what was not taken."""
    people.print(f"{found.kind}: {found.reason}", markup=False)
    for cause in found.causes:
        people.print(f"  {cause.name}: {cause.sentence}", markup=False)
    base, after = found.errors, found.extended_errors
    if base is not None and after is not None:
        people.print(f"held out: {', '.join(found.held_out)}", markup=False)
        rows = [["noise floor", f"{base.noise_floor:.3g}"], ["base", f"{base.rmse:.3g}"],
                ["extended", f"{after.rmse:.3g}"]]  # fmt: skip
        show_table("error on runs held out", ["model", f"rmse [{base.unit}]"], rows)
    if found.removed is not None and found.causes:
        people.print(
            f"the extension removes {100 * found.removed:.0f} % of the removable error",
            markup=False,
        )
    if found.extended is not None:
        kind = "extended" if found.causes else "refitted"
        people.print(f"{kind} model: {found.extended.source}", markup=False)
    show_table(
        "what the refit changed",
        ["number", "stated", "now", "of its tolerance"],
        [[one.name.replace("_", " "), f"{one.stated:.4g}", f"{one.now:.4g} {one.unit}",
          f"{one.share:+.2f}"] for one in found.refit],
    )  # fmt: skip
    if found.rivals:
        show_table("not taken", ["cause", "why"], [[r.name, r.why_not] for r in found.rivals])
