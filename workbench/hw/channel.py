"""Bytes to a supply that speaks text: a serial port or a raw socket behind two verbs."""

from __future__ import annotations

import select
import socket
from typing import Protocol

from serial import Serial, SerialException

from workbench.errors import HardwareError
from workbench.hw.connection import Connection, not_reachable

__all__ = ["Channel", "open_channel"]

CHUNK = 4096
CONNECT_S = 2.0


class Channel(Protocol):
    """A way for bytes, there and back."""

    def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            OSError: when the way is gone.
        """
        ...

    def receive(self, seconds: float) -> bytes:
        """Return what came, as soon as something did; nothing after so many seconds.

        Raises:
            OSError: when the way is gone.
        """
        ...

    def close(self) -> None:
        """Close it; closing twice does no harm."""
        ...


def open_channel(connection: Connection) -> Channel:
    """Open the port or the socket.

    Raises:
        HardwareError: when nothing can be opened there.
    """
    try:
        return _Port(connection) if connection.kind == "serial" else _Socket(connection)
    except OSError as error:  # SerialException is one
        raise HardwareError(not_reachable(connection)) from error


class _Socket:
    def __init__(self, connection: Connection) -> None:
        self._link = socket.create_connection(connection.host_and_port, CONNECT_S)
        self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        self._link.sendall(data)

    def receive(self, seconds: float) -> bytes:
        ready, _, _ = select.select([self._link], [], [], max(seconds, 0.0))
        if not ready:
            return b""
        if data := self._link.recv(CHUNK):
            return data
        raise ConnectionResetError("the other side hung up")

    def close(self) -> None:
        self._link.close()


class _Port:
    def __init__(self, connection: Connection) -> None:
        # exclusive: without it a second program could open the port and take half of the bytes
        self._port = Serial(connection.address, connection.baud, exclusive=True)

    def send(self, data: bytes) -> None:
        self._port.write(data)
        self._port.flush()

    def receive(self, seconds: float) -> bytes:
        if not self._port.is_open:
            raise SerialException("the port was closed")
        self._port.timeout = max(seconds, 0.0)
        first = self._port.read(1)
        return first + self._port.read(self._port.in_waiting) if first else b""

    def close(self) -> None:
        self._port.close()
