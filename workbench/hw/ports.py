"""Where a supply may be after its cable came back: ports of this computer, the likeliest first."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace

from serial.tools.list_ports import comports

from workbench.hw.connection import Connection

__all__ = ["Adapter"]


@dataclass(frozen=True)
class Adapter:
    """The USB adapter that a port belongs to, as far as the system tells.

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
                if os.path.realpath(port.device) == connection.place:
                    maker = None if port.vid is None else (port.vid, port.pid)
                    return cls(maker, port.serial_number)
        return cls(None, None)

    def elsewhere(self, connection: Connection) -> Iterator[Connection]:
        """Yield where else the supply may be; a port of another make of adapter is left alone."""
        if connection.kind != "serial" or self.maker is None:
            return
        for port in sorted(comports(), key=lambda port: port.serial_number != self.serial):
            maker = None if port.vid is None else (port.vid, port.pid)
            if os.path.realpath(port.device) != connection.place and maker == self.maker:
                yield replace(connection, address=port.device)
