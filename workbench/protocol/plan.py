"""From a protocol and a bench to the list of what will be done; no I/O, nothing is switched."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import ROUND_HALF_EVEN, Decimal

from workbench.errors import FileFault, FileFaults, InputError
from workbench.protocol.bench import BenchFile
from workbench.protocol.experiment import Mode, Protocol, Role, Run, Step, Sweep
from workbench.protocol.files import Document, Location
from workbench.protocol.release import PlannedRelease, drop, pull

__all__ = ["Plan", "PlannedDrive", "PlannedPrompt", "PlannedRun", "make_plan"]

RAMP_STEP_S = 0.1
"""Time between two voltages of a ramp: a supply on a serial line takes some 20 a second."""


@dataclass(frozen=True)
class PlannedPrompt:
    """A text that the operator confirms."""

    text: str


@dataclass(frozen=True)
class PlannedDrive:
    """What the supply gives.

    Args:
        voltage: final voltage [V], as the supply can set it.
        speed: rotor speed [rad/s] that the calibration gives for `voltage`.
        steps: (time since the output is switched on [s], voltage [V]), first at 0.
    """

    voltage: Decimal
    speed: float
    steps: tuple[tuple[float, Decimal], ...]

    @property
    def name(self) -> str:
        """Return a short name for folders and tables, `16.99`."""
        return f"{self.speed:.2f}"

    @property
    def ramp(self) -> float:
        """Return the time from switching on to the final voltage [s]."""
        return self.steps[-1][0]


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
    """

    number: int
    mode: Mode
    action: PlannedDrive | PlannedRelease
    rest: float
    duration: float
    role: Role
    repeat: int

    @property
    def name(self) -> str:
        """Return a short name for folders and tables, `hop-16.99`."""
        return f"{self.mode}-{self.action.name}"


@dataclass(frozen=True)
class Plan:
    """What will be done, in order."""

    title: str
    items: tuple[PlannedPrompt | PlannedRun, ...]
    current_limit: float

    @property
    def runs(self) -> tuple[PlannedRun, ...]:
        """Return the runs alone."""
        return tuple(item for item in self.items if isinstance(item, PlannedRun))

    @property
    def seconds(self) -> float:
        """Return the time that the bench is busy, without the operator's [s]."""
        return sum(run.rest + run.duration for run in self.runs)


def make_plan(protocol: Document[Protocol], bench: BenchFile, voltage_step: Decimal) -> Plan:
    """Check a protocol against a bench and lay out its runs.

    Args:
        protocol: the protocol as read.
        bench: the bench it shall run on.
        voltage_step: smallest step of the supply [V].

    Raises:
        FileFaults: with every run that the bench or its calibration does not allow.
    """
    planner = _Planner(protocol, bench, voltage_step)
    items = [
        item
        for i, step in enumerate(protocol.content.steps)
        for item in planner.lay_out(step, ("steps", i))
    ]
    current = planner.current_limit()
    if planner.faults:
        raise FileFaults(planner.faults)
    return Plan(protocol.content.title, tuple(_numbered(items)), current)


def _numbered(items: list[PlannedPrompt | PlannedRun]) -> Iterator[PlannedPrompt | PlannedRun]:
    number = 0
    for item in items:
        if isinstance(item, PlannedRun):
            number += 1
            item = replace(item, number=number)
        yield item


def _planned(
    condition: Run | Sweep, action: PlannedDrive | PlannedRelease, repeat: int
) -> PlannedRun:
    return PlannedRun(
        number=0,
        mode=condition.mode,
        action=action,
        rest=condition.rest,
        duration=condition.duration,
        role=condition.role,
        repeat=repeat,
    )


class _Planner:
    def __init__(
        self, protocol: Document[Protocol], bench: BenchFile, voltage_step: Decimal
    ) -> None:
        self.protocol = protocol
        self.bench = bench
        self.voltage_step = voltage_step
        self.faults: list[FileFault] = []

    def lay_out(self, step: Step, at: Location) -> list[PlannedPrompt | PlannedRun]:
        if step.prompt is not None:
            return [PlannedPrompt(step.prompt)]
        if step.run is not None:
            return list(self._run(step.run, (*at, "run")))
        if step.sweep is not None:
            return list(self._sweep(step.sweep, (*at, "sweep")))
        return []

    def current_limit(self) -> float:
        asked, bench = self.protocol.content.limits.current, self.bench.supply.limits.current
        if asked is not None and asked > bench:
            text = (
                f"current {asked:g} A is above the limit of bench {self.bench.name!r}, {bench:g} A"
            )
            self._fault(("limits", "current"), text)
        return bench if asked is None else asked

    def _run(self, run: Run, at: Location) -> Iterator[PlannedRun]:
        action = self._action(run, at)
        if action is not None:
            for repeat in range(1, run.repeats + 1):
                yield _planned(run, action, repeat)

    def _action(self, run: Run, at: Location) -> PlannedDrive | PlannedRelease | None:
        """Return what follows the rest, or note the fault."""
        if run.pull is not None:
            return pull(run.pull)
        if run.height is not None:
            return drop(run.height)
        key = "speed" if run.speed is not None else "voltage"
        return self._drive(run, self._voltage(run.speed, run.voltage, (*at, key)), at)

    def _sweep(self, sweep: Sweep, at: Location) -> list[PlannedRun]:
        speeds, voltages = sweep.speeds or (), sweep.voltages or ()
        found = [self._voltage(s, None, (*at, "speeds", i)) for i, s in enumerate(speeds)]
        found += [self._voltage(None, v, (*at, "voltages", i)) for i, v in enumerate(voltages)]
        drives = [self._drive(sweep, voltage, at) for voltage in found]
        runs = [
            _planned(sweep, drive, repeat)
            for repeat in range(1, sweep.repeats + 1)
            for drive in drives
            if drive is not None
        ]
        if sweep.order == "random":
            random.Random(sweep.seed).shuffle(runs)
        return runs

    def _voltage(self, speed: float | None, volts: float | None, at: Location) -> Decimal | None:
        """Return the voltage that the supply can set, or note the fault."""
        calibration = self.bench.line
        try:
            exact = calibration.voltage(speed) if speed is not None else float(volts or 0)
            rounded = Decimal(repr(exact)).quantize(self.voltage_step, ROUND_HALF_EVEN)
            calibration.speed(float(rounded))
        except InputError as error:
            self._fault(at, str(error))
            return None
        own = self.protocol.content.limits.voltage
        for owner, limit in (
            (f"bench {self.bench.name!r}", self.bench.supply.limits.voltage),
            ("this protocol", own if own is not None else math.inf),
        ):
            if float(rounded) > limit:
                self._fault(at, f"{rounded} V is above the limit of {owner}, {limit:g} V")
                return None
        return rounded

    def _drive(
        self, condition: Run | Sweep, voltage: Decimal | None, at: Location
    ) -> PlannedDrive | None:
        if voltage is None:
            return None
        if condition.ramp >= condition.duration:
            text = (
                f"ramp {condition.ramp:g} s is not shorter than duration {condition.duration:g} s"
            )
            self._fault((*at, "ramp"), text)
        return PlannedDrive(
            voltage=voltage,
            speed=self.bench.line.speed(float(voltage)),
            steps=self._ramp(voltage, condition.ramp),
        )

    def _ramp(self, voltage: Decimal, ramp: float) -> tuple[tuple[float, Decimal], ...]:
        """Return even steps from the calibration's lowest voltage, within the bench's slew."""
        lowest = Decimal(repr(self.bench.line.lowest)).quantize(self.voltage_step)
        rise = float(voltage - lowest)
        ramp = max(ramp, rise / self.bench.supply.limits.slew)
        count = math.ceil(round(ramp / RAMP_STEP_S, 9))
        if rise <= 0 or count == 0:
            return ((0.0, voltage),)
        return tuple(
            (
                ramp * i / count,
                (lowest + (voltage - lowest) * i / count).quantize(
                    self.voltage_step, ROUND_HALF_EVEN
                ),
            )
            for i in range(count + 1)
        )

    def _fault(self, at: Location, text: str) -> None:
        fault = self.protocol.fault(at, text)
        if fault not in self.faults:
            self.faults.append(fault)
