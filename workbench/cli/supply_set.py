"""`workbench supply set`: drive a voltage by hand, under guardian and limits."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict
from decimal import Decimal
from typing import Annotated

import typer

from workbench.bench import RealBench
from workbench.bench_supply import check_new_scale, made_ready
from workbench.cli.output import emit, people, tell
from workbench.errors import InputError, Interrupted, SafetyStop
from workbench.hw import Reading, Supply, switch_on, watch
from workbench.output import BY_HAND, MAY_BE_ON
from workbench.progress import Stage
from workbench.protocol.plan import Level
from workbench.protocol.quantity import parse_quantity
from workbench.protocol.ramps import Ramps
from workbench.signals import Signals

__all__ = ["drive_by_hand"]

POLL_S = 0.2
RAMP_S = 0.5
LOWEST_V = 1.0  # the ramp begins there, as a run's does on the built-in bench

VoltsArgument = Annotated[str, typer.Argument(metavar="VOLTAGE", help="Such as '2.5 V'.")]
AmpsOption = Annotated[
    str, typer.Option("--current", help="Current limit, such as '0.8 A'; the bench's if left out.")
]
SecondsOption = Annotated[
    str, typer.Option("--for", help="Such as '10 s'; until Ctrl-C when left out.")
]


def drive_by_hand(bench: RealBench, volts: str, amps: str, seconds: str, as_json: bool) -> None:
    """Drive a voltage, show what the supply reads, and switch off.

    Args:
        bench: whose supply it is.
        volts: as typed, with its unit.
        amps: current limit as typed; the bench's when empty.
        seconds: how long; until Ctrl-C when empty.
        as_json: print the last reading as JSON.

    Raises:
        InputError: when it is outside the bench's limits.
        SafetyStop: as a run.
        Interrupted: on Ctrl-C; the output is off.
    """
    limits = bench.file.supply.limits
    voltage = _within("voltage", volts, limits.voltage, "V")
    current = _within("current", amps, limits.current, "A") if amps else limits.current
    duration = _typed(seconds, "time") if seconds else float("inf")
    reading: Reading | None = None
    confirmed = False
    with Signals() as signals:
        try:
            with signals.first_only(), bench.open_supply() as supply:
                try:
                    _prepare(supply, bench, current)
                    reading = _ramp(supply, bench, voltage)
                    reading = _hold(supply, reading, duration)
                    supply.ramp_down()
                finally:
                    signals.hold()  # a second Ctrl-C would cut off what the first one leads to
                    confirmed = supply.off() and supply.terminals_dead()
        except KeyboardInterrupt:
            if not confirmed:
                raise SafetyStop(f"stopped by the user; {MAY_BE_ON}, {BY_HAND}") from None
            raise Interrupted("stopped by the user; the output is off, confirmed") from None
    if as_json and reading is not None:
        emit(asdict(reading) | {"output": False})
    else:
        print("output off, confirmed")


def _prepare(supply: Supply, bench: RealBench, current: float) -> None:
    tell("prepare the supply")
    identity = made_ready(bench.file, supply, bench.limits(current)).identity
    check_new_scale(supply, bench.ledger_of(identity), identity.firmware, tell)


def _ramp(supply: Supply, bench: RealBench, voltage: float) -> Reading:
    volts = Decimal(repr(voltage)).quantize(bench.voltage_step)
    ramps = Ramps(LOWEST_V, bench.voltage_step, bench.file.supply.limits.slew)
    (_, first), *steps = ramps.through([Level(0.0, volts, 0.0)], RAMP_S, 0.0)
    reading, began = switch_on(supply, first), supply.clock.now()
    for after, step in steps:
        supply.clock.sleep(began + after - supply.clock.now())
        supply.set_voltage(step)
        reading = watch(supply)
    return reading


def _hold(supply: Supply, reading: Reading, duration: float) -> Reading:
    """Watch the running supply and show what it reads."""
    end = supply.clock.now() + duration
    told = "Ctrl-C switches off" if duration == float("inf") else f"for {duration:g} s"
    tell(Stage(f"on, {told}", seconds=None if duration == float("inf") else duration))
    while (left := end - supply.clock.now()) > 0:
        supply.clock.sleep(min(POLL_S, left))
        reading = watch(supply)
        tell.update(Stage(f"{reading.voltage_V:.2f} V, {reading.current_A:.3f} A, {told}"))
    with suppress(ValueError):
        people.print(f"{reading.voltage_V:.2f} V, {reading.current_A:.3f} A", markup=False)
    return reading


def _within(what: str, typed: str, highest: float, unit: str) -> float:
    value = _typed(typed, {"V": "voltage", "A": "current"}[unit])
    if not 0 < value <= highest:
        raise InputError(
            f"{what} {value:g} {unit} is outside the bench's limits, above 0 to {highest:g} "
            f"{unit}; nothing was sent"
        )
    return value


def _typed(text: str, dimension: str) -> float:
    try:
        return parse_quantity(text, dimension, typed=True)[0]
    except ValueError as fault:
        raise InputError(str(fault)) from None
