"""`workbench investigate`: the closed loop of runs and diagnoses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.bundle import Bundle
from workbench.cli.completion import bench_names, protocol_files
from workbench.cli.console import progress, stderr
from workbench.cli.diagnosis_output import show_diagnosis, show_next
from workbench.cli.plain_output import JsonFlag, emit
from workbench.cli.terminal import carry_out_at_terminal
from workbench.errors import InputError
from workbench.investigate import BenchJob, ClosedLoop, Following, Round, next_object
from workbench.report import diagnose_into
from workbench.run import load_bench, make_bench
from workbench.schemas import Protocol, load, parse_quantity

__all__ = ["investigate"]


def investigate(
    protocol: Annotated[
        Path, typer.Argument(help="Protocol file of the first runs.", autocompletion=protocol_files)
    ],
    bench: Annotated[
        str, typer.Option(help="Bench file, or `virtual`.", autocompletion=bench_names)
    ] = "virtual",
    budget: Annotated[
        str, typer.Option(help="Bench time that may be spent, handling included.")
    ] = "30 min",
    out: Annotated[
        Path | None, typer.Option(help="Folder of runs and rounds; by default by the protocol.")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Run, diagnose, propose, run, until one cause remains, or none, or time is up.

    The first protocol needs runs of both roles, as for `workbench diagnose`. Bundles are kept in
    OUT/runs and the rounds beside them: called again, it continues from the runs that are there.

    Example: workbench investigate protocols/free-decay.yaml --bench virtual --budget 30min
    """
    minutes = _minutes(budget)
    lab = load_bench(bench)
    folder = out or Path("investigations") / protocol.stem
    loop = ClosedLoop(
        lab,
        make_bench(lab.content),
        folder,
        carry_out_at_terminal,
        diagnose_into,
        _show_run,
        progress,
    )
    rounds = []
    for found in loop.rounds(load(protocol, Protocol), minutes):
        rounds.append(found)
        _show(found, as_json)
    if as_json:
        emit(_object(rounds))


def _minutes(budget: str) -> float:
    try:
        return parse_quantity(budget, "time")[0] / 60
    except ValueError as error:
        raise InputError(f"--budget: {error}") from None


def _show_run(bundle: Bundle) -> None:
    stderr.print(f"bundle: {bundle.path}", markup=False)


def _proposal(one: Round[BenchJob]) -> Following | None:
    return None if one.proposed is None else one.proposed.following


def _show(one: Round[BenchJob], as_json: bool) -> None:
    """Print a round; without its tables where stdout is for the JSON object."""
    stderr.print(f"round {one.number}, {one.minutes:.0f} min of bench time so far", style="bold")
    if as_json:
        stderr.print(f"{one.found.kind}: {one.found.reason}", markup=False)
    else:
        show_diagnosis(one.found)
    show_next(one.found, _proposal(one))
    if one.ended is not None:
        stderr.print(f"ended: {one.ended}", markup=False)


def _object(rounds: Sequence[Round[BenchJob]]) -> dict[str, Any]:
    """Return the last diagnosis with all rounds."""
    objects = [one.as_json() | one.found.as_json() | next_object(_proposal(one)) for one in rounds]
    return objects[-1] | {"rounds": objects}
