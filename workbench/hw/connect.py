"""Opening a supply: the one place that picks the driver."""

from __future__ import annotations

import re
from collections.abc import Callable

from workbench.errors import InputError
from workbench.hw import korad, scpi
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.dps import DpsSupply
from workbench.hw.hanmatek import HanmatekSupply
from workbench.hw.health import Health
from workbench.hw.korad import KoradSupply
from workbench.hw.line import Line
from workbench.hw.modbus import ModbusSupply
from workbench.hw.models import FAMILIES, Family
from workbench.hw.riden import RidenSupply
from workbench.hw.scpi import ScpiSupply
from workbench.hw.supply import Supply
from workbench.hw.text import TextSupply
from workbench.hw.transport import Transport
from workbench.hw.wirelog import WireLog

__all__ = ["DRIVERS", "open_supply"]

Driver = Callable[[Connection, Clock, WireLog, Health], Supply]


def _over_modbus(driver: type[ModbusSupply]) -> Driver:
    def opened(connection: Connection, clock: Clock, wire_log: WireLog, health: Health) -> Supply:
        registers = driver.registers
        link = Transport(
            connection,
            writable=registers.writable,
            clock=clock,
            wire_log=wire_log,
            health=health,
            marks=registers.marks,
        )
        try:
            return driver(link, clock)
        except BaseException:
            link.close()
            raise

    return opened


def _over_text(
    driver: Callable[[Line, Clock], TextSupply],
    terminator: bytes,
    may_send: re.Pattern[str],
    gap_s: float,
) -> Driver:
    def opened(connection: Connection, clock: Clock, wire_log: WireLog, health: Health) -> Supply:
        if connection.kind == "rtu-over-tcp":
            raise InputError(
                f"{connection.address}: this family speaks text and no RTU frames; "
                "its kind is serial, or tcp for a raw socket"
            )
        line = Line(
            connection,
            terminator=terminator,
            may_send=may_send,
            gap_s=gap_s,
            clock=clock,
            wire_log=wire_log,
            health=health,
        )
        try:
            return driver(line, clock)
        except BaseException:
            line.close()
            raise

    return opened


DRIVERS: dict[Family, Driver] = {
    "riden": _over_modbus(RidenSupply),
    "dps": _over_modbus(DpsSupply),
    "hanmatek": _over_modbus(HanmatekSupply),
    "korad": _over_text(KoradSupply, korad.TERMINATOR, korad.MAY_SEND, korad.GAP_S),
    "scpi": _over_text(ScpiSupply, scpi.TERMINATOR, scpi.MAY_SEND, scpi.GAP_S),
}


def open_supply(
    connection: Connection,
    *,
    clock: Clock,
    wire_log: WireLog,
    family: str = "riden",
    health: Health | None = None,
) -> Supply:
    """Open the supply at a place; its model is read from itself, nothing is changed yet.

    Use it in a `with` block, whose end switches the output off, and `prepare` it before use.

    Args:
        connection: where it is.
        clock: what it waits with and stamps readings with.
        wire_log: takes one JSON line per message on the wire.
        family: which driver to use; `model_named(...).family` gives it for a bench file.
        health: receives how each exchange goes, for who cannot wait for its end.

    Raises:
        InputError: when there is no such family, or it cannot be reached in that way.
        HardwareError: when it cannot be reached, does not answer, or is of an unknown model.
    """
    for known in FAMILIES:
        if family == known:
            return DRIVERS[known](connection, clock, wire_log, health or Health())
    raise InputError(f"no driver for family {family!r}; there are {', '.join(FAMILIES)}")
