"""At which port a supply is: before it is opened, and after its cable came back."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

from serial.tools.list_ports import comports
from serial.tools.list_ports_common import ListPortInfo

from workbench.errors import HardwareError
from workbench.hw.clock import SystemClock
from workbench.hw.connect import open_supply
from workbench.hw.connection import Connection
from workbench.hw.supply import Identity

__all__ = ["Adapter", "find_supply", "who_answers"]


@dataclass(frozen=True)
class Adapter:
    """The USB adapter that a port belongs to, as far as the system says.

    Args:
        maker: USB vendor and product; None when it is no USB port.
        serial: of the adapter; cheap ones have none.
    """

    maker: tuple[int, int] | None
    serial: str | None

    @classmethod
    def at(cls, connection: Connection) -> Adapter:
        """Return the adapter of a port that is there now."""
        if connection.kind == "serial":
            for port in comports():
                if os.path.realpath(port.device) == connection.resolved_address:
                    return cls(_maker(port), port.serial_number)
        return cls(None, None)

    def elsewhere(self, connection: Connection) -> Iterator[Connection]:
        """Yield where else the supply may be; a port of another make of adapter is left alone."""
        if connection.kind != "serial" or self.maker is None:
            return
        for port in sorted(comports(), key=lambda port: port.serial_number != self.serial):
            if (
                os.path.realpath(port.device) != connection.resolved_address
                and _maker(port) == self.maker
            ):
                yield replace(connection, address=port.device)


def _maker(port: ListPortInfo) -> tuple[int, int] | None:
    return None if port.vid is None else (port.vid, port.pid)


def find_supply(connection: Connection, family: str, model: str, serial: str) -> Connection:
    """Ask at each serial port who is there, and return the one where the supply is.

    Args:
        connection: how it is reached, but for the port.
        family: which driver to use.
        model: of the supply.
        serial: its serial number.

    Raises:
        HardwareError: when it is at no port; the message says who is.
    """
    met: list[str] = []
    for port in comports():
        candidate = replace(connection, address=port.device)
        who = who_answers(candidate, family)
        if who is not None and (who.model, who.serial) == (model, serial):
            return candidate
        met.append(port.device if who is None else f"{port.device} ({who.model} {who.serial})")
    raise HardwareError(
        f"no {model} with serial number {serial} at any port; is the cable in, the supply on, and "
        f"no other program holding the port? Ports asked: {', '.join(met) or 'none'}"
    )


def who_answers(connection: Connection, family: str) -> Identity | None:
    """Return who answers at a place, and change nothing there."""
    with suppress(HardwareError):
        supply = open_supply(
            connection, clock=SystemClock(), wire_log=lambda line: None, family=family
        )
        try:
            return supply.identify()
        finally:
            supply.close()
    return None
