"""A supply by hand: who is there, switching it off, and signing for a safety stop."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

from workbench.bench import RealBench
from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import DEAD_V, MODELS, Connection, Supply
from workbench.hw.models import Family
from workbench.hw.ports import who_answers
from workbench.output import BY_HAND, MAY_BE_ON, Ledger, Standing
from workbench.progress import Progress

__all__ = ["acknowledged", "opened", "switch_off", "who_is_at"]

_POLL_S = 0.1
_LET_GO_S = 10.0  # for a guardian to switch off and see the terminals dead


def who_is_at(
    place: str, families: Sequence[Family], rtu_over_tcp: bool
) -> dict[str, object] | None:
    """Return who answers at a place; sets nothing.

    Args:
        place: serial port, or host:port.
        families: each is tried, at the speeds of its models.
        rtu_over_tcp: whether a host:port passes RTU frames on.

    Returns:
        port, family, baud and what the supply says of itself; None where nobody answers.
    """
    is_serial = not place.rpartition(":")[2].isdecimal()
    kind = "serial" if is_serial else "rtu-over-tcp" if rtu_over_tcp else "tcp"
    for family in families:
        bauds = sorted({model.baud for model in MODELS if model.family == family})
        for baud in bauds if is_serial else bauds[:1]:
            with suppress(InputError):  # this family cannot be reached in that way
                who = who_answers(Connection(kind, place, baud=baud), family)
                if who is not None:
                    return {"port": place, "family": family, "baud": baud} | who._asdict()
    return None


@contextmanager
def opened(bench: RealBench, *, force: bool = False) -> Iterator[Supply]:
    """Open a real bench's supply without touching its output."""
    found = bench.open_supply(force=force)
    try:
        yield found
    finally:
        found.close()


def switch_off(bench: RealBench) -> bool:
    """Stop who drives, switch the output off, and tell whether that was confirmed.

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


def acknowledged(bench: RealBench, name: str, who: str, tell: Progress) -> Iterator[Standing]:
    """Sign for the safety stops of a supply, and yield each once it is signed for.

    Args:
        bench: whose supply it is.
        name: of the bench as it was typed, for messages.
        who: has looked at the cause.
        tell: is told where the supply could not be asked whether it is off.

    Raises:
        InputError: when no stop waits for it.
        SafetyStop: when the output is on.
    """
    standing = _standing(bench.ledgers()) or _standing(_asked_for_ledgers(bench))
    if not standing:
        raise InputError(f"bench {name!r}: no stop is waiting for an acknowledgement")
    if any(stop.output.live for stop in standing.values()):
        _require_off(bench, name, tell)
    for ledger in standing:
        yield ledger.acknowledge(who)


def _standing(known: list[Ledger]) -> dict[Ledger, Standing]:
    return {one: stop for one in known if (stop := one.standing())}


def _asked_for_ledgers(bench: RealBench) -> list[Ledger]:
    """Return the ledger of whoever is there: one that was damaged tells no more where that is."""
    with suppress(HardwareError), opened(bench) as device:
        return [bench.ledger_of(device.identify())]
    return []


def _require_off(bench: RealBench, name: str, tell: Progress) -> None:
    """Refuse to sign for an output that is on; where the supply is out of reach, a person knows."""
    try:
        with opened(bench) as device:
            reading = device.measure()
    except HardwareError as error:
        tell(f"it could not be asked whether it is off: {error}")
        return
    if reading.output or reading.voltage_V > DEAD_V:
        raise SafetyStop(
            f"{name}: its output is on, {reading.voltage_V:g} V; {BY_HAND}, "
            f"or type: workbench supply off --bench {name}"
        )
