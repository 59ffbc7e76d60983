"""What all drivers do alike: refuse, wait until the supply holds a value, find CV or CC."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from typing import Protocol, TypeVar

from workbench.errors import InputError
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.supply import Mode

__all__ = ["mode_from_readings", "read_back", "refuse_beyond", "reopen"]

READ_BACKS = 3  # a setpoint may show a moment after its acknowledgement
READ_BACK_PAUSE_S = 0.05
SAG_V = 0.05  # a voltage this far below its setpoint is held down by something

Value = TypeVar("Value")


class SupplyLink(Protocol):
    """What leads to a supply."""

    connection: Connection

    @property
    def connected(self) -> bool: ...

    def open(self, connection: Connection | None = None) -> None: ...

    def close(self) -> None: ...


def reopen(
    link: SupplyLink, identify: Callable[[], object], connection: Connection | None = None
) -> None:
    """Open a lost link again, for switching off, and make sure who is there.

    Args:
        link: to the supply.
        identify: raises when another supply answers than at first.
        connection: where to look; where it was when left out.
    """
    if link.connected and connection is None:
        return
    before = link.connection
    try:
        link.open(connection)
        identify()
    except BaseException:
        link.close()  # so that the next try checks again
        link.connection = before
        raise


def read_back(read: Callable[[], Value], wanted: Value, clock: Clock) -> Value:
    """Read until the wanted value is there, a few times; return what was read last."""
    found = read()
    for _ in range(READ_BACKS - 1):
        if found == wanted:
            break
        clock.sleep(READ_BACK_PAUSE_S)
        found = read()
    return found


def refuse_beyond(name: str, value: Decimal, highest: Decimal, unit: str) -> None:
    """Refuse what a model cannot do.

    Raises:
        InputError: when the value is more than the highest; nothing was sent.
    """
    if value > highest:
        raise InputError(
            f"{name}: {value} {unit} is more than this model's {highest} {unit}; nothing was sent"
        )


def mode_from_readings(
    output: bool, volts: tuple[Decimal, Decimal], amps: tuple[Decimal, Decimal], step: Decimal
) -> Mode:
    """Distinguish CC from CV where a supply does not say it reliably.

    Args:
        output: whether it is on.
        volts: set, measured [V].
        amps: limit, measured [A].
        step: one count of the current [A].
    """
    at_limit = amps[1] >= amps[0] - step
    return "CC" if output and at_limit and float(volts[0] - volts[1]) > SAG_V else "CV"
