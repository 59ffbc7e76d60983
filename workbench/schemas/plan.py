"""What will be done: the plan of an experiment, as data; no I/O, nothing is switched."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

from workbench.schemas.expect import Range
from workbench.schemas.experiment import Mode, Role
from workbench.schemas.prompt import PromptQuestion
from workbench.schemas.release import PlannedRelease
from workbench.schemas.stop import StopWhen

__all__ = [
    "Item",
    "Level",
    "Named",
    "Plan",
    "PlannedDrive",
    "PlannedPause",
    "PlannedPrompt",
    "PlannedRun",
]


@dataclass(frozen=True)
class PlannedPrompt:
    """What the operator is shown, and confirms or answers.

    Args:
        text: to show.
        picture: path of a picture.
        question: value to type in.
    """

    text: str
    picture: Path | None = None
    question: PromptQuestion | None = None


@dataclass(frozen=True)
class PlannedPause:
    """A wait with the output off.

    Args:
        seconds: how long [s].
        why: shown meanwhile.
    """

    seconds: float
    why: str


class Level(NamedTuple):
    """One level of a drive.

    Args:
        since: when its ramp begins, from switching on [s].
        voltage: reached at the ramp's end [V], as the supply can set it.
        speed: rotor speed [rad/s] that the calibration gives for `voltage`.
    """

    since: float
    voltage: Decimal
    speed: float


@dataclass(frozen=True)
class PlannedDrive:
    """What the supply gives.

    Args:
        levels: one, or those of a staircase.
        steps: (time since the output is switched on [s], voltage [V]), first at 0.
    """

    levels: tuple[Level, ...]
    steps: tuple[tuple[float, Decimal], ...]

    @property
    def ramp(self) -> float:
        """Return the time from switching on to the first level [s]."""
        return next(time for time, volts in self.steps if volts == self.levels[0].voltage)

    @property
    def voltage(self) -> Decimal | None:
        """Return the voltage of a drive of one level [V], None for a staircase."""
        return self.levels[0].voltage if len(self.levels) == 1 else None

    @property
    def speed(self) -> float | None:
        """Return the speed of a drive of one level [rad/s], None for a staircase."""
        return self.levels[0].speed if len(self.levels) == 1 else None

    @property
    def name(self) -> str:
        """Return a short name for folders and tables, `16.99` or `5.99to21.01`."""
        speeds = [level.speed for level in self.levels]
        ends = (min(speeds), max(speeds))
        return f"{ends[0]:.2f}" if len(speeds) == 1 else f"{ends[0]:.2f}to{ends[1]:.2f}"

    @property
    def asked(self) -> str:
        """Return what is asked for, in words."""
        if len(self.levels) == 1:
            _, volts, speed = self.levels[0]
            return f"{volts} V, {speed:.3f} rad/s"
        speeds = [level.speed for level in self.levels]
        return f"{len(speeds)} levels, {min(speeds):.2f} to {max(speeds):.2f} rad/s"


@dataclass(frozen=True)
class Named:
    """A file as another one names it.

    Args:
        name: a built-in name or a path.
        beside: folder of the file that names it.
    """

    name: str
    beside: Path


@dataclass(frozen=True)
class PlannedRun:
    """One condition, ready to be carried out.

    Args:
        number: place in the plan, from 1.
        mode: what the robot does.
        action: what follows the rest: the supply drives it, or the operator lets it go.
        rest: still time before [s].
        duration: time with the output on, or after the release [s].
        role: use in a later diagnosis.
        repeat: number of this repetition, from 1.
        shape: beam of this run, None for the experiment's.
        expect: (name of a result, the range that it must lie in).
        before: prompts before it.
        after: prompts after it.
        stop_when: prediction error that ends it.
    """

    number: int
    mode: Mode
    action: PlannedDrive | PlannedRelease
    rest: float
    duration: float
    role: Role
    repeat: int
    shape: Named | None = None
    expect: tuple[tuple[str, Range], ...] = ()
    before: tuple[PlannedPrompt, ...] = ()
    after: tuple[PlannedPrompt, ...] = ()
    stop_when: StopWhen | None = None

    @property
    def name(self) -> str:
        """Return a short name for folders and tables, `hop-16.99`."""
        return f"{self.mode}-{self.action.name}"


Item = PlannedPrompt | PlannedPause | PlannedRun


@dataclass(frozen=True)
class Plan:
    """What will be done, in order; prompts and pauses belong to the run that follows.

    Args:
        title: of the protocol.
        items: in order.
        current_limit: of the supply [A].
        warnings: what in the files is allowed, and probably not meant.
    """

    title: str
    items: tuple[Item, ...]
    current_limit: float
    warnings: tuple[str, ...] = ()

    @property
    def runs(self) -> tuple[PlannedRun, ...]:
        """Return the runs alone."""
        return tuple(item for item in self.items if isinstance(item, PlannedRun))

    @property
    def drives(self) -> bool:
        """Return whether any run needs the supply."""
        return any(isinstance(run.action, PlannedDrive) for run in self.runs)

    @property
    def prompts(self) -> int:
        """Return how often the operator is asked, releases included."""
        return sum(_prompts(item) for item in self.items)

    @property
    def seconds(self) -> float:
        """Return the time that the bench is busy, without the operator's [s]."""
        pauses = [item for item in self.items if isinstance(item, PlannedPause)]
        busy = sum(run.rest + run.duration for run in self.runs)
        return busy + sum(pause.seconds for pause in pauses)

    def by_run(self) -> list[tuple[list[PlannedPrompt | PlannedPause], PlannedRun]]:
        """Return each run with the prompts and pauses before it."""
        parts: list[tuple[list[PlannedPrompt | PlannedPause], PlannedRun]] = []
        waiting: list[PlannedPrompt | PlannedPause] = []
        for item in self.items:
            if isinstance(item, PlannedRun):
                parts.append((waiting, item))
                waiting = []
            else:
                waiting.append(item)
        return parts

    def without(self, done: Container[int]) -> Plan:
        """Return what is left when the runs of these numbers are done.

        Their prompts and pauses go with them.
        """
        items: list[Item] = []
        waiting: list[Item] = []
        for item in self.items:
            waiting.append(item)
            if isinstance(item, PlannedRun):
                items += [] if item.number in done else waiting
                waiting = []
        return replace(self, items=tuple(items))


def _prompts(item: Item) -> int:
    match item:
        case PlannedPrompt():
            return 1
        case PlannedPause():
            return 0
        case PlannedRun():
            release = 2 if isinstance(item.action, PlannedRelease) else 0
            return release + len(item.before) + len(item.after)
