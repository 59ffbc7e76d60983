"""A supply by hand: who is there, a voltage, switching it off, signing for a safety stop."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from decimal import Decimal
from math import isinf

from workbench.errors import HardwareError, InputError, Interrupted, SafetyStop
from workbench.hw import (
    DEAD_V,
    MODELS,
    Connection,
    Family,
    Reading,
    Supply,
    switch_on,
    watch,
    who_answers,
)
from workbench.output import BY_HAND, MAY_BE_ON, Latch, Ledger
from workbench.progress import Progress, Stage
from workbench.run.bench import RealBench
from workbench.run.bench_supply import check_new_scale, made_ready
from workbench.schemas import Level, Ramps
from workbench.signals import Signals

__all__ = ["acknowledged", "drive", "opened", "switch_off", "who_is_at"]

_POLL_S = 0.1
_WATCH_S = 0.2
_RAMP_S = 0.5
_LOWEST_V = 1.0  # the ramp begins there, as a run's does on the built-in bench
_LET_GO_S = 10.0  # for a guardian to switch off and see the terminals dead


def who_is_at(
    address: str, families: Sequence[Family], rtu_over_tcp: bool
) -> dict[str, object] | None:
    """Return who answers at a place; sets nothing.

    Args:
        address: serial port, or host:port.
        families: each is tried, at the speeds of its models.
        rtu_over_tcp: whether a host:port passes RTU frames on.

    Returns:
        port, family, baud and what the supply says of itself; None where nobody answers.
    """
    is_serial = not address.rpartition(":")[2].isdecimal()
    kind = "serial" if is_serial else "rtu-over-tcp" if rtu_over_tcp else "tcp"
    for family in families:
        bauds = sorted({model.baud for model in MODELS if model.family == family})
        for baud in bauds if is_serial else bauds[:1]:
            with suppress(InputError):  # this family cannot be reached in that way
                who = who_answers(Connection(kind, address, baud=baud), family)
                if who is not None:
                    return {"port": address, "family": family, "baud": baud} | who._asdict()
    return None


@contextmanager
def opened(bench: RealBench, *, force: bool = False) -> Iterator[Supply]:
    """Open a real bench's supply without touching its output."""
    found = bench.open_supply(force=force)
    try:
        yield found
    finally:
        found.close()


def drive(
    bench: RealBench,
    voltage: float,
    seconds: float,
    progress: Progress,
    update: Progress,
    current: float | None = None,
) -> Reading | None:
    """Drive a voltage, watch what the supply reads, and switch off; return the last reading.

    Args:
        bench: whose supply it is.
        voltage: [V].
        seconds: how long; infinite until Ctrl-C.
        progress: receives what begins.
        update: receives each reading.
        current: limit [A]; the bench's where it is left out.

    Raises:
        InputError: when it is outside the bench's limits; nothing was sent.
        SafetyStop: as a run.
        Interrupted: on Ctrl-C; the output is off.
    """
    limits = bench.file.supply.limits
    _require_within("voltage", voltage, limits.voltage, "V")
    current = limits.current if current is None else current
    _require_within("current", current, limits.current, "A")
    reading: Reading | None = None
    confirmed = False
    with Signals() as signals:
        try:
            with signals.first_only(), bench.open_supply() as supply:
                try:
                    progress("prepare the supply")
                    _prepare(supply, bench, current, progress)
                    reading = _ramp(supply, bench, voltage)
                    reading = _hold(supply, reading, seconds, progress, update)
                    supply.ramp_down()
                finally:
                    signals.hold()  # a second Ctrl-C would cut off what the first one leads to
                    confirmed = supply.off() and supply.terminals_dead()
        except KeyboardInterrupt:
            if not confirmed:
                raise SafetyStop(f"stopped by the user; {MAY_BE_ON}, {BY_HAND}") from None
            raise Interrupted("stopped by the user; the output is off, confirmed") from None
    return reading


def _require_within(what: str, value: float, highest: float, unit: str) -> None:
    if not 0 < value <= highest:
        raise InputError(
            f"{what} {value:g} {unit} is outside the bench's limits, above 0 to {highest:g} "
            f"{unit}; nothing was sent"
        )


def _prepare(supply: Supply, bench: RealBench, current: float, progress: Progress) -> None:
    identity = made_ready(bench.file, supply, bench.limits(current)).identity
    check_new_scale(supply, bench.ledger_of(identity), identity.firmware, progress)


def _ramp(supply: Supply, bench: RealBench, voltage: float) -> Reading:
    volts = Decimal(repr(voltage)).quantize(bench.voltage_step)
    ramps = Ramps(_LOWEST_V, bench.voltage_step, bench.file.supply.limits.slew)
    (_, first), *steps = ramps.through([Level(0.0, volts, 0.0)], _RAMP_S, 0.0)
    reading, began = switch_on(supply, first), supply.clock.now()
    for after, step in steps:
        supply.clock.sleep(began + after - supply.clock.now())
        supply.set_voltage(step)
        reading = watch(supply)
    return reading


def _hold(
    supply: Supply, reading: Reading, seconds: float, progress: Progress, update: Progress
) -> Reading:
    """Watch the running supply and report what it reads."""
    end = supply.clock.now() + seconds
    known = None if isinf(seconds) else seconds
    how_long = "Ctrl-C switches off" if known is None else f"for {known:g} s"
    progress(Stage(f"on, {how_long}", seconds=known))
    while (remaining_s := end - supply.clock.now()) > 0:
        supply.clock.sleep(min(_WATCH_S, remaining_s))
        reading = watch(supply)
        update(Stage(f"{reading.voltage_V:.2f} V, {reading.current_A:.3f} A, {how_long}"))
    return reading


def switch_off(bench: RealBench) -> bool:
    """Stop who drives, switch the output off, and return whether that was confirmed.

    Args:
        bench: whose supply it is.

    Raises:
        SafetyStop: when another program has the supply and does not let go of it.
        HardwareError: when the supply cannot be reached.
    """
    for ledger in bench.ledgers():
        _stop_who_drives(ledger)
    try:
        with opened(bench, force=True) as device:
            return device.off() and device.terminals_dead()
    except HardwareError as error:
        if any(ledger.held() for ledger in bench.ledgers()):
            raise SafetyStop(
                f"{error}\nanother program has it and is trying to switch it off; "
                f"{MAY_BE_ON}, {BY_HAND}"
            ) from error
        raise


def _stop_who_drives(ledger: Ledger) -> None:
    """Ask the guardian that holds the supply to switch off, and wait until it has let go."""
    end = time.monotonic() + _LET_GO_S
    while ledger.held() and time.monotonic() < end:
        ledger.ask_for_off()
        time.sleep(_POLL_S)
    ledger.asked_for_off()  # for whoever comes next it is no request


def acknowledged(bench: RealBench, name: str, who: str, progress: Progress) -> Iterator[Latch]:
    """Sign for the safety stops of a supply, and yield each once it is signed for.

    Args:
        bench: whose supply it is.
        name: of the bench as it was typed, for messages.
        who: has looked at the cause.
        progress: called where the supply could not be asked whether it is off.

    Raises:
        InputError: when no stop waits for it.
        SafetyStop: when the output is on.
    """
    latches = _latches(bench.ledgers()) or _latches(_asked_for_ledgers(bench))
    if not latches:
        raise InputError(f"bench {name!r}: no stop is waiting for an acknowledgement")
    if any(stop.output.live for stop in latches.values()):
        _require_off(bench, name, progress)
    for ledger in latches:
        yield ledger.acknowledge(who)


def _latches(known: list[Ledger]) -> dict[Ledger, Latch]:
    return {one: stop for one in known if (stop := one.latch())}


def _asked_for_ledgers(bench: RealBench) -> list[Ledger]:
    """Return the ledger of whoever is there: one that was damaged no longer says where that is."""
    with suppress(HardwareError), opened(bench) as device:
        return [bench.ledger_of(device.identify())]
    return []


def _require_off(bench: RealBench, name: str, progress: Progress) -> None:
    """Refuse to sign for an output that is on; where the supply is out of reach, a person knows."""
    try:
        with opened(bench) as device:
            reading = device.measure()
    except HardwareError as error:
        progress(f"it could not be asked whether it is off: {error}")
        return
    if reading.output or reading.voltage_V > DEAD_V:
        raise SafetyStop(
            f"{name}: its output is on, {reading.voltage_V:g} V; {BY_HAND}, "
            f"or type: workbench supply off --bench {name}"
        )
