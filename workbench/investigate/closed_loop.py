"""The closed loop on a bench: run, diagnose, propose, run; all that it made is kept on disk.

`workbench.diagnose.investigate` says when it goes on; here are the runs, the rounds and their
files, so that a loop that was stopped goes on from what is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from workbench.bundle import Bundle, bundle_names, runs_named
from workbench.diagnose import Diagnosis, Rig, robot_of
from workbench.errors import InputError
from workbench.investigate.diagnosed import Diagnosed
from workbench.investigate.investigation import Round, investigate
from workbench.investigate.next_protocol import Following
from workbench.investigate.proposed import ProposedRun, minutes_of
from workbench.progress import Progress
from workbench.run import Bench, Experiment, read_experiment
from workbench.schemas import BenchFile, Document, PlannedRun, Protocol

__all__ = ["BenchJob", "CarryOut", "ClosedLoop", "Diagnose"]

CarryOut = Callable[[Experiment, Bench, Path], Iterable[tuple[Bundle, list[str]]]]
"""Makes the runs of an experiment on a bench, into a folder of bundles."""

Diagnose = Callable[[Path, Rig, Mapping[str, Path], Sequence[Bundle], Progress], Diagnosed]
"""Diagnoses a rig with its runs, and writes model, answer and page into a folder."""


@dataclass(frozen=True)
class BenchJob:
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


@dataclass(frozen=True)
class ClosedLoop:
    """The runs of one investigation, on one bench.

    Args:
        lab: the bench's file.
        bench: its devices.
        out: folder of runs and rounds.
        carry_out: makes the runs of a protocol.
        diagnose: answers after each round.
        made: receives each run that was made.
        progress: receives each stage.
    """

    lab: Document[BenchFile]
    bench: Bench
    out: Path
    carry_out: CarryOut
    diagnose: Diagnose
    made: Callable[[Bundle], None]
    progress: Progress

    @property
    def runs(self) -> Path:
        """Return the folder of the bundles."""
        return self.out / "runs"

    def rounds(self, protocol: Document[Protocol], budget: float) -> Iterator[Round[BenchJob]]:
        """Go on from the runs that are there, and yield each round when its diagnosis is there.

        Args:
            protocol: of the first runs.
            budget: bench time that may be spent [min], that of earlier calls included.

        Raises:
            InputError: when the budget is less than the first runs take.
        """
        first, spent = self._first(protocol), self._minutes_spent()
        needed = spent + (0.0 if first is None else first.minutes)
        if needed > budget:
            raise InputError(
                f"{protocol.path} takes about {needed:.0f} min of bench time with all handling, "
                f"and the budget is {budget:g} min; give a larger --budget"
            )
        number = len(list(self.out.glob("round-*"))) + 1
        yield from investigate(first, self._run, self._look, budget, number, spent)

    def _complete(self) -> list[Bundle]:
        """Return the bundles of the runs that were made, in order."""
        found = runs_named([self.runs], self.runs) if bundle_names(self.runs) else []
        bundles = [Bundle.open(folder) for folder in found]
        return [one for one in bundles if one.manifest.status == "complete"]

    def _first(self, protocol: Document[Protocol]) -> BenchJob | None:
        """Return what is still to be run of the first protocol, None where all of it is there."""
        named = [b for b in self._complete() if b.asked.protocol == protocol.path.name]
        done = frozenset(bundle.asked.number for bundle in named)
        remaining = self._read(protocol).plan.without(done).runs
        return BenchJob(protocol, done, _minutes_of(remaining)) if remaining else None

    def _minutes_spent(self) -> float:
        """Return the bench time that the runs of earlier calls took [min]."""
        made = [bundle.asked for bundle in self._complete()]
        trials = [
            ProposedRun(one.mode, 0.0, one.duration_s or 0.0, one.rest_s or 0.0) for one in made
        ]
        return minutes_of(trials)

    def _read(self, protocol: Document[Protocol]) -> Experiment:
        return read_experiment(protocol.path, self.lab, self.bench.voltage_step)

    def _run(self, job: BenchJob) -> None:
        """Make the runs of a protocol that do not exist yet."""
        asked = self._read(job.protocol)
        asked = replace(asked, plan=asked.plan.without(job.done))
        for bundle, _ in self.carry_out(asked, self.bench, self.runs):
            self.made(bundle)

    def _look(self, number: int) -> tuple[Diagnosis, BenchJob | None]:
        """Diagnose all runs that exist and propose the next."""
        bundles = self._complete()
        rig, files = robot_of(bundles, self.progress)
        folder = self.out / f"round-{number}"
        folder.mkdir(parents=True)
        done = self.diagnose(folder, rig, files, bundles, self.progress)
        found, proposed = done.found, done.proposed
        self.progress(f"report: {done.report}")
        if proposed is None:
            return found, None
        minutes = proposed.proposal.minutes
        return found, BenchJob(proposed.protocol, frozenset(), minutes, proposed)


def _minutes_of(runs: Sequence[PlannedRun]) -> float:
    return minutes_of([ProposedRun(run.mode, 0.0, run.duration, run.rest) for run in runs])
