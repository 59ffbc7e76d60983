"""From a protocol and a bench to the list of what will be done; no I/O, nothing is switched."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal

from workbench.errors import FileFault, FileFaults, InputError
from workbench.protocol.bench import BenchFile
from workbench.protocol.experiment import Mode, Protocol, Role, Run, Step, Sweep
from workbench.protocol.files import Document, Location

__all__ = ["Plan", "PlannedPrompt", "PlannedRun", "make_plan"]

RAMP_STEP_S = 0.1
"""Time between two voltages of a ramp: a supply on a serial line takes some 20 a second."""
RUNNABLE: tuple[Mode, ...] = ("hop", "clamped")


@dataclass(frozen=True)
class PlannedPrompt:
    """A text that the operator confirms."""

    text: str


@dataclass(frozen=True)
class PlannedRun:
    """One condition, ready to be carried out.

    Args:
        number: place in the plan, from 1.
        mode: what the robot does.
        voltage: final voltage [V], as the supply can set it.
        speed: rotor speed [rad/s] that the calibration gives for `voltage`.
        steps: (time since the output is switched on [s], voltage [V]), first at 0.
        rest: still time before [s].
        duration: time with the output on [s].
        role: use in a later diagnosis.
        repeat: number of this repetition, from 1.
    """

    number: int
    mode: Mode
    voltage: Decimal
    speed: float
    steps: tuple[tuple[float, Decimal], ...]
    rest: float
    duration: float
    role: Role
    repeat: int

    @property
    def name(self) -> str:
        """Return a short name for folders and tables, `hop-16.99`."""
        return f"{self.mode}-{self.speed:.2f}"

    @property
    def ramp(self) -> float:
        """Return the time from switching on to the final voltage [s]."""
        return self.steps[-1][0]


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
            item = PlannedRun(**{**item.__dict__, "number": number})
        yield item


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
        if run.mode not in RUNNABLE:
            text = f"mode {run.mode!r} cannot be run yet; modes that run: {', '.join(RUNNABLE)}"
            self._fault((*at, "mode"), text)
            return
        key = "speed" if run.speed is not None else "voltage"
        voltage = self._voltage(run.speed, run.voltage, (*at, key))
        if voltage is not None:
            for repeat in range(1, run.repeats + 1):
                yield self._planned(run, voltage, repeat, at)

    def _sweep(self, sweep: Sweep, at: Location) -> list[PlannedRun]:
        speeds, voltages = sweep.speeds or (), sweep.voltages or ()
        found = [self._voltage(s, None, (*at, "speeds", i)) for i, s in enumerate(speeds)]
        found += [self._voltage(None, v, (*at, "voltages", i)) for i, v in enumerate(voltages)]
        runs = [
            self._planned(sweep, voltage, repeat, at)
            for repeat in range(1, sweep.repeats + 1)
            for voltage in found
            if voltage is not None
        ]
        if sweep.order == "random":
            random.Random(sweep.seed).shuffle(runs)
        return runs

    def _voltage(self, speed: float | None, volts: float | None, at: Location) -> Decimal | None:
        """Return the voltage that the supply can set, or note the fault."""
        calibration = self.bench.calibration
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

    def _planned(
        self, condition: Run | Sweep, voltage: Decimal, repeat: int, at: Location
    ) -> PlannedRun:
        if condition.ramp >= condition.duration:
            text = (
                f"ramp {condition.ramp:g} s is not shorter than duration {condition.duration:g} s"
            )
            self._fault((*at, "ramp"), text)
        return PlannedRun(
            number=0,
            mode=condition.mode,
            voltage=voltage,
            speed=self.bench.calibration.speed(float(voltage)),
            steps=self._ramp(voltage, condition.ramp),
            rest=condition.rest,
            duration=condition.duration,
            role=condition.role,
            repeat=repeat,
        )

    def _ramp(self, voltage: Decimal, ramp: float) -> tuple[tuple[float, Decimal], ...]:
        """Return even steps from the calibration's lowest voltage, within the bench's slew."""
        lowest = Decimal(repr(self.bench.calibration.lowest)).quantize(self.voltage_step)
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
