"""`workbench investigate`: the closed loop of runs and diagnoses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.bench import Bench, load_bench, make_bench
from workbench.bundle import Bundle
from workbench.cli.attended import carry_out_at_desk
from workbench.cli.completing import bench_names, protocol_files
from workbench.cli.diagnose import (
    next_object,
    robot_of,
    show_diagnosis,
    show_next,
    write_report,
)
from workbench.cli.output import JsonFlag, emit, people, tell
from workbench.diagnose import Diagnosis, Following, Round, Trial, following, minutes_of
from workbench.diagnose import diagnose as diagnose_rig
from workbench.diagnose import investigate as investigate_rounds
from workbench.errors import InputError
from workbench.experiment import read_experiment
from workbench.protocol import BenchFile, Document, PlannedRun, Protocol, load, parse_quantity

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
    """Run, diagnose, propose, run, until one cause stands, nothing is left or the time is over.

    The first protocol needs runs of both roles, as for `workbench diagnose`. Bundles are kept in
    OUT/runs and the rounds beside them: called again, it goes on from the runs that are there.

    Example: workbench investigate protocols/free-decay.yaml --bench virtual --budget 30min
    """
    minutes = _minutes(budget)
    lab = load_bench(bench)
    loop = _Loop(lab, make_bench(lab.content), out or Path("investigations") / protocol.stem)
    first = loop.first(load(protocol, Protocol))
    number, spent = loop.rounds_before() + 1, loop.minutes_before()
    needed = spent + (0.0 if first is None else first.minutes)
    if needed > minutes:
        raise InputError(
            f"{protocol} takes about {needed:.0f} min of bench time with all handling, and the "
            f"budget is {minutes:g} min; give a larger --budget"
        )
    rounds = []
    for found in investigate_rounds(first, loop.run, loop.look, minutes, number, spent):
        rounds.append(found)
        _show(found, as_json)
    if as_json:
        emit(_object(rounds))


def _minutes(budget: str) -> float:
    try:
        return parse_quantity(budget, "time")[0] / 60
    except ValueError as error:
        raise InputError(f"--budget: {error}") from None


@dataclass(frozen=True)
class _Job:
    """What the loop can run: a protocol, those of its runs that are still to be made.

    Args:
        protocol: as read.
        done: numbers of the runs that exist.
        minutes: that the others take on the bench.
        following: what proposed it; None for the first.
    """

    protocol: Document[Protocol]
    done: frozenset[int]
    minutes: float
    following: Following | None = None


class _Loop:
    """The runs of one investigation, on one bench.

    Args:
        lab: the bench's file.
        bench: its devices.
        out: folder of runs and rounds.
    """

    def __init__(self, lab: Document[BenchFile], bench: Bench, out: Path) -> None:
        self.lab, self.bench, self.out = lab, bench, out
        self.runs = out / "runs"

    def complete(self) -> list[Bundle]:
        """Return the bundles of the runs that were made, in order."""
        bundles = Bundle.find_all([self.runs], self.runs) if any(self.runs.glob("*/")) else []
        return [one for one in bundles if one.manifest.status == "complete"]

    def first(self, protocol: Document[Protocol]) -> _Job | None:
        """Return what is still to be run of the first protocol, None where all of it is there."""
        named = [b for b in self.complete() if b.asked.protocol == protocol.path.name]
        done = frozenset(bundle.asked.number for bundle in named)
        plan = read_experiment(protocol.path, self.lab, self.bench.voltage_step).plan
        left = plan.without(done).runs
        return _Job(protocol, done, _minutes_of(left)) if left else None

    def rounds_before(self) -> int:
        """Return how many rounds earlier calls came to."""
        return len(list(self.out.glob("round-*")))

    def minutes_before(self) -> float:
        """Return the bench time that the runs of earlier calls took [min]."""
        made = [bundle.asked for bundle in self.complete()]
        trials = [Trial(one.mode, 0.0, one.duration_s or 0.0, one.rest_s or 0.0) for one in made]
        return minutes_of(trials)

    def run(self, job: _Job) -> None:
        """Make the runs of a protocol that do not exist yet."""
        asked = read_experiment(job.protocol.path, self.lab, self.bench.voltage_step)
        asked = replace(asked, plan=asked.plan.without(job.done))
        for bundle, _ in carry_out_at_desk(asked, self.bench, self.runs):
            people.print(f"made {bundle.path}", markup=False)

    def look(self, number: int) -> tuple[Diagnosis, _Job | None]:
        """Diagnose all runs that exist and propose the next."""
        bundles = self.complete()
        rig, files = robot_of(bundles)
        name, folder = f"round-{number}", self.out / f"round-{number}"
        folder.mkdir(parents=True)
        found = diagnose_rig(rig, folder, name, tell)
        proposed = following(found, bundles, folder, name, tell)
        tell(f"report: {write_report(folder, found, files, proposed)}")
        if proposed is None:
            return found, None
        minutes = proposed.proposal.minutes
        return found, _Job(proposed.protocol, frozenset(), minutes, proposed)


def _minutes_of(runs: Sequence[PlannedRun]) -> float:
    return minutes_of([Trial(run.mode, 0.0, run.duration, run.rest) for run in runs])


def _proposal(one: Round[_Job]) -> Following | None:
    return None if one.proposed is None else one.proposed.following


def _show(one: Round[_Job], as_json: bool) -> None:
    """Print a round; its tables would stand in the way of an object on stdout."""
    people.print(f"round {one.number}, {one.minutes:.0f} min of bench time so far", style="bold")
    if as_json:
        people.print(f"{one.found.kind}: {one.found.reason}", markup=False)
    else:
        show_diagnosis(one.found)
    show_next(one.found, _proposal(one))
    if one.ended is not None:
        people.print(f"ended: {one.ended}", markup=False)


def _object(rounds: Sequence[Round[_Job]]) -> dict[str, Any]:
    """Return the last diagnosis with all rounds."""
    told = [one.as_json() | one.found.as_json() | next_object(_proposal(one)) for one in rounds]
    return told[-1] | {"rounds": told}
