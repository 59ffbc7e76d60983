"""A dry run: the same engine and driver, on a simulated supply of the bench's model.

Nothing of the laboratory is opened. The clock is simulated, so hours take a moment; the words that
are reported are those that really went over the simulated line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from workbench.bundle import Bundle, Event, events, sentence
from workbench.hw import SimulatedClock, written
from workbench.progress import Progress, counted
from workbench.run.bench import CameraSpan, Operator, SimulatedBench, Subject
from workbench.run.engine import carry_out
from workbench.run.experiment import Experiment
from workbench.run.operators import QuietOperator
from workbench.schemas import BenchFile, PlannedRun

__all__ = ["Instant", "Rehearsed", "rehearse"]

_RUN_EVENTS = (events.RunAsked, events.Complete, events.SupplyReading)
"""They say nothing of the bench."""


class Instant(NamedTuple):
    """What happens at one time of a run.

    Args:
        time: since the run began [s].
        events: in words.
        words: written to the supply, in words.
    """

    time: float
    events: tuple[str, ...]
    words: tuple[str, ...]


@dataclass(frozen=True)
class Rehearsed:
    """One run as it was rehearsed.

    Args:
        run: as planned.
        busy: time of the bench, without the operator's [s].
        instants: in order.
    """

    run: PlannedRun
    busy: float
    instants: tuple[Instant, ...]


class _RehearsalBench(SimulatedBench):
    """A bench that films nothing."""

    def __init__(self, file: BenchFile) -> None:
        super().__init__(file, SimulatedClock())
        self.cameras = 0.0

    def start_cameras(self, operator: Operator) -> None:
        """Note when, as the run's time begins anew with them."""
        self.cameras = self.clock.now()

    def collect(
        self, subject: Subject, span: CameraSpan, bundle: Bundle, operator: Operator
    ) -> None:
        """Film nothing."""


def rehearse(
    experiment: Experiment, progress: Progress = lambda text: None
) -> tuple[Rehearsed, ...]:
    """Carry out an experiment on a simulated supply and return what happened, run by run.

    A run that is repeated is carried out once.

    Args:
        experiment: plan and files.
        progress: receives each run as it begins.

    Raises:
        WorkbenchError: what a run on the bench would end with, such as a limit that the supply
            cannot hold.
    """
    bench = _RehearsalBench(experiment.bench.content)
    rehearsed: list[Rehearsed] = []
    known: dict[PlannedRun, Rehearsed] = {}
    runs = experiment.plan.runs
    with TemporaryDirectory(prefix="rehearsal-") as folder:
        for number, run in enumerate(runs, start=1):
            alike = replace(run, number=0, repeat=0)
            if alike in known:
                rehearsed.append(replace(known[alike], run=run))
                continue
            progress(counted("rehearse a run", number, len(runs)))
            alone = replace(experiment, plan=replace(experiment.plan, items=(run,)))
            begin = bench.clock.now()
            (bundle,) = carry_out(alone, bench, Path(folder), QuietOperator(), lambda text: None)
            busy = bench.clock.now() - begin
            known[alike] = Rehearsed(run, busy, _instants(bundle, bench, begin))
            rehearsed.append(known[alike])
    return tuple(rehearsed)


def _instants(bundle: Bundle, bench: _RehearsalBench, begin: float) -> tuple[Instant, ...]:
    """Bring journal and wire together by time."""
    happened: dict[float, list[str]] = {}
    words: dict[float, list[str]] = {}
    origin = begin
    for time, event in bundle.record.events():
        if isinstance(event, events.CamerasStarted):
            origin = bench.cameras
        if not isinstance(event, _RUN_EVENTS):
            happened.setdefault(_at(origin + time - begin), []).append(_words(event))
    for one in bundle.record.exchanges():
        word = written(one.data) if one.way == "sent" else None
        if word is not None:
            words.setdefault(_at(one.time_s - begin), []).append(word)
    return tuple(
        Instant(time, tuple(happened.get(time, ())), tuple(words.get(time, ())))
        for time in sorted(set(happened) | set(words))
    )


def _words(event: Event) -> str:
    if not isinstance(event, events.PromptAnswered):
        return sentence(event)
    asked = "" if event.name is None else f" (type {event.name})"
    return f"prompt: {event.text}{asked}"


def _at(time: float) -> float:
    return round(time, 3)
