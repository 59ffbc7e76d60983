"""From a protocol and a bench to the plan; every fault is reported with its position."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_HALF_EVEN, Decimal
from typing import NoReturn

from workbench.errors import FileFault, FileFaults, InputError
from workbench.schemas.bench import BenchFile
from workbench.schemas.experiment import (
    PartFile,
    Protocol,
    RunFields,
    RunStep,
    Staircase,
    Step,
    Sweep,
)
from workbench.schemas.files import Document
from workbench.schemas.parts import Parts, part_of
from workbench.schemas.plan import (
    Item,
    Level,
    Named,
    Plan,
    PlannedDrive,
    PlannedPause,
    PlannedPrompt,
    PlannedRun,
)
from workbench.schemas.prompt import OperatorPrompt
from workbench.schemas.ramps import RAMP_STEP_S, Ramps
from workbench.schemas.release import PlannedRelease, drop, pull
from workbench.schemas.wording import Location

__all__ = ["MOST_RUNS", "MOST_S", "MOST_STEPS", "make_plan"]

MOST_RUNS = 2000
"""Of a protocol: more than anybody measures before looking at the first of them."""
MOST_S = 7 * 24 * 3600.0
"""Longest time of a protocol on the bench, prompts not counted [s]."""
MOST_STEPS = 50_000
"""Steps and prompts of a protocol, those of its parts counted as often as they are included."""
_ROUNDING = 1e-6  # of limits that are written to six digits
_EVERY_RUN = re.compile(r"\b(each|every)\s+run\b", re.IGNORECASE)
_MOST_VOLTAGES = 10_000  # in one run: a thousand seconds of ramps


def make_plan(
    protocol: Document[Protocol],
    bench: BenchFile,
    voltage_step: Decimal,
    parts: Parts | None = None,
) -> Plan:
    """Check a protocol against a bench and lay out its runs.

    Args:
        protocol: the protocol as read.
        bench: the bench it shall run on.
        voltage_step: smallest step of the supply [V].
        parts: what the protocol includes.

    Raises:
        FileFaults: with every run that the bench or its calibration does not allow.
    """
    planner = _Planner(protocol, bench, voltage_step, parts or {})
    items = _owned(planner.lay_out(protocol))
    planner.require_limits()
    planner.require_names(items)
    current = planner.current_limit()
    planner.require_calibration()
    if planner.faults:
        raise FileFaults(planner.faults)
    return Plan(
        protocol.content.title, tuple(_numbered(items)), current, tuple(planner.asked_once(items))
    )


def _owned(items: list[Item]) -> list[Item]:
    """Give the prompts that follow the last run to that run."""
    last = max((i for i, item in enumerate(items) if isinstance(item, PlannedRun)), default=-1)
    run = items[last] if last >= 0 else None
    if not isinstance(run, PlannedRun):
        return items
    trailing = [item for item in items[last + 1 :] if isinstance(item, PlannedPrompt)]
    return [*items[:last], replace(run, after=(*run.after, *trailing))]


def _numbered(items: Sequence[Item]) -> Iterator[Item]:
    number = 0
    for item in items:
        if isinstance(item, PlannedRun):
            number += 1
            item = replace(item, number=number)
        yield item


@dataclass(frozen=True)
class _Position:
    """Position of something: a file, and the way to it from the top."""

    document: Document[Protocol] | Document[PartFile]
    location: Location

    def to(self, *further: str | int) -> _Position:
        return _Position(self.document, (*self.location, *further))

    def fault(self, text: str) -> FileFault:
        return self.document.fault(self.location, text)


class _Planner:
    def __init__(
        self, protocol: Document[Protocol], bench: BenchFile, voltage_step: Decimal, parts: Parts
    ) -> None:
        self.protocol, self.bench, self.parts = protocol, bench, parts
        self.ramps = Ramps(bench.line.lowest, voltage_step, bench.supply.limits.slew)
        self.voltage_step = voltage_step
        self.faults: list[FileFault] = []
        self._reported: set[FileFault] = set()
        self._steps = self._runs = 0
        self._seconds = 0.0
        self._asked: dict[int, _Position] = {}  # id of a planned prompt -> its position

    def lay_out(self, document: Document[Protocol] | Document[PartFile]) -> list[Item]:
        """Return what the steps of a file come to, its parts included."""
        return [
            item
            for i, step in enumerate(document.content.steps)
            for item in self._step(step, _Position(document, ("steps", i)))
        ]

    def current_limit(self) -> float:
        asked, bench = self.protocol.content.limits.current, self.bench.supply.limits.current
        if asked is not None and asked > bench:
            text = (
                f"current {asked:g} A is above the limit of bench {self.bench.name!r}, {bench:g} A"
            )
            self._fault(_Position(self.protocol, ("limits", "current")), text)
        return bench if asked is None else asked

    def require_calibration(self) -> None:
        """Refuse a bench whose speed-voltage line is another than the protocol names."""
        asked, line = self.protocol.content.calibration, self.bench.line
        if asked is not None and asked != line.id:
            text = f"bench {self.bench.name!r} has calibration {line.id!r}, not {asked!r}"
            self._fault(_Position(self.protocol, ("calibration",)), text)

    def require_limits(self) -> None:
        """Refuse limits of the protocol that are looser than the bench's: they would limit nothing.

        A bench has no limit of the speed of its own, but one of the voltage that gives it.
        """
        limits, bench, line = self.protocol.content.limits, self.bench, self.bench.line
        volts = bench.supply.limits.voltage
        fastest = line.slope * min(volts, line.highest) + line.offset
        for key, asked, limit, unit in (
            ("voltage", limits.voltage, volts, "V"),
            ("speed", limits.speed, fastest, "rad/s"),
        ):
            if asked is not None and asked > limit + _ROUNDING:
                self._fault(
                    _Position(self.protocol, ("limits", key)),
                    f"{key} {asked:g} {unit} is above the limit of bench {bench.name!r}, "
                    f"{limit:g} {unit}; limits of a protocol may only be tighter",
                )

    def require_names(self, items: Sequence[Item]) -> None:
        """Refuse two values of one name at one run, whose later answer would replace the first."""
        names: dict[str, PlannedPrompt] = {}
        for item in items:
            prompts = (item,) if isinstance(item, PlannedPrompt) else ()
            if isinstance(item, PlannedRun):
                prompts = (*item.before, *item.after)
            for prompt in prompts:
                name = "" if prompt.question is None else prompt.question.name
                if name in names and (at := self._asked.get(id(prompt))) is not None:
                    self._fault(
                        at.to("value", "name"),
                        f"name: {name!r} is asked for twice at one run; each value of a run needs "
                        "a name of its own",
                    )
                elif name:
                    names[name] = prompt
            if isinstance(item, PlannedRun):
                names = {}

    def asked_once(self, items: Sequence[Item]) -> Iterator[str]:
        """Yield a warning for each prompt that speaks of every run and is put before one alone."""
        for at, item in enumerate(items):
            if not isinstance(item, PlannedPrompt) or not _EVERY_RUN.search(item.text):
                continue
            if sum(isinstance(one, PlannedRun) for one in items[at + 1 :]) > 1:
                text = (
                    "this prompt speaks of every run but is asked once; as `before: [TEXT]` of the "
                    "run or sweep it is asked before each"
                )
                yield str(self._asked[id(item)].fault(text))

    def _grow(
        self, at: _Position, runs: int = 0, seconds: float = 0.0, condition: RunFields | None = None
    ) -> None:
        """Count what a step comes to, before it is laid out, and give up where that is too much."""
        self._runs, self._seconds = self._runs + runs, self._seconds + seconds
        if condition is not None:
            self._steps += runs * (len(condition.before) + len(condition.after))
        for count, most, what in (
            (self._runs, MOST_RUNS, "runs"),
            (self._steps, MOST_STEPS, "steps and prompts"),
        ):
            if count > most:
                self._give_up(
                    at,
                    f"{count} {what} up to here, and a protocol may have at most {most}; use fewer "
                    "values or repeats, or make several protocols of it",
                )
        if self._seconds > MOST_S:
            self._give_up(
                at,
                f"{self._seconds / 3600:.0f} h on the bench up to here, and a protocol may take at "
                f"most {MOST_S / 3600:.0f} h; use fewer repeats or shorter times, or make several "
                "protocols of it",
            )

    def _give_up(self, at: _Position, text: str) -> NoReturn:
        self._fault(at, text)
        raise FileFaults(self.faults)

    def _prompt(self, prompt: OperatorPrompt, at: _Position) -> PlannedPrompt:
        folder = at.document.path.parent
        picture = None if prompt.picture is None else folder / prompt.picture
        planned = PlannedPrompt(prompt.text, picture, prompt.value)
        self._asked[id(planned)] = at
        return planned

    def _step(self, step: Step, at: _Position) -> list[Item]:
        self._steps += 1
        self._grow(at, seconds=0.0 if step.pause is None else step.pause.time)
        if step.prompt is not None:
            return [self._prompt(step.prompt, at.to("prompt"))]
        if step.pause is not None:
            return [PlannedPause(step.pause.time, step.pause.why or "pause")]
        if step.run is not None:
            return list(self._run(step.run, at.to("run")))
        if step.sweep is not None:
            return list(self._sweep(step.sweep, at.to("sweep")))
        if step.staircase is not None:
            return list(self._staircase(step.staircase, at.to("staircase")))
        return self.lay_out(self.parts[part_of(at.document, step.include or "")])

    def _run(self, run: RunStep, at: _Position) -> list[PlannedRun]:
        self._grow(at, run.repeats, run.repeats * (run.rest + run.duration), run)
        action = self._action(run, at)
        return [
            self._planned(run, action, run.duration, repeat, at)
            for repeat in range(1, run.repeats + 1)
            if action is not None
        ]

    def _action(self, run: RunStep, at: _Position) -> PlannedDrive | PlannedRelease | None:
        """Return what follows the rest, or note the fault."""
        if run.pull is not None:
            return pull(run.pull)
        if run.height is not None:
            return drop(run.height)
        key = "speed" if run.speed is not None else "voltage"
        level = self._level(run.speed, run.voltage, at.to(key))
        return self._drive(run, run.duration, level, at)

    def _sweep(self, sweep: Sweep, at: _Position) -> list[PlannedRun]:
        several = (sweep.speeds, sweep.voltages, sweep.pulls, sweep.heights)
        runs = sweep.repeats * sum(len(values) for values in several if values is not None)
        self._grow(at, runs, runs * (sweep.rest + sweep.duration), sweep)
        actions: list[PlannedDrive | PlannedRelease | None] = [
            self._drive(sweep, sweep.duration, level, at) for level in self._levels(sweep, at)
        ]
        actions += [pull(force) for force in sweep.pulls or ()]
        actions += [drop(height) for height in sweep.heights or ()]
        planned = [
            self._planned(sweep, action, sweep.duration, repeat, at)
            for repeat in range(1, sweep.repeats + 1)
            for action in actions
            if action is not None
        ]
        if sweep.order == "random":
            random.Random(sweep.seed).shuffle(planned)
        return planned

    def _staircase(self, stairs: Staircase, at: _Position) -> list[PlannedRun]:
        count = len(stairs.speeds or stairs.voltages or ())
        count += count - 1 if stairs.down else 0
        seconds = stairs.repeats * (stairs.rest + stairs.dwell * count)
        self._grow(at, stairs.repeats, seconds, stairs)
        voltages = round(count * stairs.step_ramp / RAMP_STEP_S)
        if voltages > _MOST_VOLTAGES:
            self._give_up(
                at,
                f"ramps of {voltages} voltages in one run, and there may be at most "
                f"{_MOST_VOLTAGES}; use fewer levels or a shorter step_ramp",
            )
        found = [level for level in self._levels(stairs, at) if level is not None]
        found += found[-2::-1] if stairs.down else []
        self._require_ramp(stairs, stairs.dwell, "dwell", at)
        if not found:
            return []
        levels = tuple(level._replace(since=i * stairs.dwell) for i, level in enumerate(found))
        drive = PlannedDrive(levels, self.ramps.through(levels, stairs.ramp, stairs.step_ramp))
        duration = stairs.dwell * len(levels)
        return [
            self._planned(stairs, drive, duration, repeat, at)
            for repeat in range(1, stairs.repeats + 1)
        ]

    def _levels(self, several: Sweep | Staircase, at: _Position) -> list[Level | None]:
        speeds, voltages = several.speeds or (), several.voltages or ()
        return [
            *(self._level(s, None, at.to("speeds", i)) for i, s in enumerate(speeds)),
            *(self._level(None, v, at.to("voltages", i)) for i, v in enumerate(voltages)),
        ]

    def _level(self, speed: float | None, volts: float | None, at: _Position) -> Level | None:
        """Return what the supply can set and the speed it gives, or note the fault."""
        try:
            exact = self.bench.line.voltage(speed) if speed is not None else float(volts or 0)
            rounded = Decimal(repr(exact)).quantize(self.voltage_step, ROUND_HALF_EVEN)
            level = Level(0.0, rounded, self.bench.line.speed(float(rounded)))
        except InputError as error:
            self._fault(at, str(error))
            return None
        if beyond := self._beyond(level):
            self._fault(at, beyond)
            return None
        return level

    def _beyond(self, level: Level) -> str | None:
        """Return which limit a level is above, or None."""
        limits, bench = self.protocol.content.limits, f"bench {self.bench.name!r}"
        volts, speed = float(level.voltage), level.speed
        for name, value, owner, limit, unit in (
            (f"{level.voltage}", volts, bench, self.bench.supply.limits.voltage, "V"),
            (f"{level.voltage}", volts, "this protocol", limits.voltage, "V"),
            (f"{speed:.2f}", speed, "this protocol", limits.speed, "rad/s"),
        ):
            if limit is not None and value > limit:
                return f"{name} {unit} is above the limit of {owner}, {limit:g} {unit}"
        return None

    def _drive(
        self, condition: RunFields, duration: float, level: Level | None, at: _Position
    ) -> PlannedDrive | None:
        if level is None:
            return None
        self._require_ramp(condition, duration, "duration", at)
        return PlannedDrive((level,), self.ramps.through((level,), condition.ramp, 0.0))

    def _require_ramp(self, condition: RunFields, whole: float, name: str, at: _Position) -> None:
        if condition.ramp >= whole:
            text = f"ramp {condition.ramp:g} s is not shorter than {name} {whole:g} s"
            self._fault(at.to("ramp"), text)

    def _planned(
        self,
        condition: RunFields,
        action: PlannedDrive | PlannedRelease,
        duration: float,
        repeat: int,
        at: _Position,
    ) -> PlannedRun:
        if condition.stop_when is not None and self.bench.tracking.live is None:
            text = (
                f"stop_when needs cameras that stream, and bench {self.bench.name!r} has no "
                "`tracking: live:`; name the stream there, or remove stop_when"
            )
            self._fault(at.to("stop_when"), text)
        beside = at.document.path.parent
        before, after = enumerate(condition.before), enumerate(condition.after)
        return PlannedRun(
            number=0,
            mode=condition.mode,
            action=action,
            rest=condition.rest,
            duration=duration,
            role=condition.role,
            repeat=repeat,
            shape=None if condition.shape is None else Named(condition.shape, beside),
            expect=() if condition.expect is None else (*condition.expect.ranges().items(),),
            before=tuple(self._prompt(one, at.to("before", i)) for i, one in before),
            after=tuple(self._prompt(one, at.to("after", i)) for i, one in after),
            stop_when=condition.stop_when,
        )

    def _fault(self, at: _Position, text: str) -> None:
        fault = at.fault(text)
        if fault not in self._reported:
            self._reported.add(fault)
            self.faults.append(fault)
