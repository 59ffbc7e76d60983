"""Opening a supply: the one place that picks the driver."""

from __future__ import annotations

from collections.abc import Callable

from workbench.errors import InputError
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.models import NEVER_WRITE
from workbench.hw.riden import RidenSupply
from workbench.hw.supply import Supply
from workbench.hw.transport import Transport, WireLog

__all__ = ["DRIVERS", "open_supply"]

Driver = Callable[[Transport, Clock], Supply]

DRIVERS: dict[str, Driver] = {"riden": RidenSupply}


def open_supply(
    connection: Connection, *, clock: Clock, wire_log: WireLog, family: str = "riden"
) -> Supply:
    """Open the supply at a place; its model is read from itself, nothing is changed yet.

    Use it in a `with` block, whose end switches the output off, and `prepare` it before use.

    Args:
        connection: where it is.
        clock: what it waits with and stamps readings with.
        wire_log: takes one JSON line per message on the wire.
        family: which driver to use; `model_named(...).family` tells it from a bench file.

    Raises:
        InputError: when there is no such family.
        HardwareError: when it cannot be reached, does not answer, or is of an unknown model.
    """
    if family not in DRIVERS:
        raise InputError(f"no driver for family {family!r}; there are {', '.join(DRIVERS)}")
    link = Transport(connection, never_write=NEVER_WRITE[family], clock=clock, wire_log=wire_log)
    try:
        return DRIVERS[family](link, clock)
    except BaseException:
        link.close()
        raise
