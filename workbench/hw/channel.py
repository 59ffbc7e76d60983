"""Bytes to a supply: a serial port or a socket behind three verbs, none of which waits for long.

This is in the path to "off", so each wait has a bound by the monotonic clock, and a port or a peer
that takes nothing is an error and not a wait.
"""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress
from typing import Protocol

from serial import Serial, SerialException

from workbench.errors import HardwareError
from workbench.hw.connection import Connection, not_reachable, resolved

__all__ = ["ECHOED", "ENDLESS_SENDER", "ByteChannel", "drop_waiting", "open_channel"]

CHUNK = 4096
CONNECT_S, RECONNECT_S = 2.0, 0.5
SEND_S = 0.4  # the longest command takes 0.1 s at 9600 baud
DRAIN_POLL_S = 0.001
DROP_BYTES, DROP_S = 4096, 0.1
ENDLESS_SENDER = "the line never becomes idle; which other device sends on it?"
ECHOED = (
    "the adapter sends back what it is sent, as some for RS485 do; switch that off, "
    "or write `echo: true` below `connection` in the bench file"
)


class ByteChannel(Protocol):
    """A way for bytes, there and back."""

    def send(self, data: bytes) -> None:
        """Send all of it within a bounded time.

        Raises:
            OSError: when the way is gone, or nothing is taken.
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


def open_channel(connection: Connection) -> ByteChannel:
    """Open the port or the socket.

    Raises:
        HardwareError: when nothing can be opened there.
    """
    try:
        way = _Port(connection) if connection.kind == "serial" else _Socket(connection)
    except OSError as error:  # SerialException is one
        raise HardwareError(not_reachable(connection)) from error
    return _WithoutEcho(way) if connection.echo else way


_reached: set[tuple[str, int]] = set()  # what was once in reach is known to be near


def drop_waiting(channel: ByteChannel) -> bytes:
    """Take out what came unasked, as far as it ends, and return the first of it.

    What a sender that has ended left behind is over within 0.1 s; one without end is not awaited.

    Raises:
        OSError: when the way is gone.
    """
    waiting, end = b"", time.monotonic() + DROP_S
    while piece := channel.receive(0.0):
        waiting = (waiting + piece)[: DROP_BYTES + 1]
        if len(waiting) > DROP_BYTES and time.monotonic() > end:
            break
    return waiting


class _Socket:
    def __init__(self, connection: Connection) -> None:
        family, address = resolved(*connection.host_and_port)
        self._link = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._link.settimeout(RECONNECT_S if address in _reached else CONNECT_S)
            self._link.connect(address)
            _reached.add(address)
            self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._link.settimeout(SEND_S)
        except BaseException:
            self._link.close()
            raise

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
        self._port = Serial(
            connection.address, connection.baud, exclusive=True, write_timeout=SEND_S
        )

    def send(self, data: bytes) -> None:
        self._port.write(data)
        end = time.monotonic() + SEND_S
        while self._port.out_waiting:  # flush() would wait for ever for a port that stalls
            if time.monotonic() > end:
                raise TimeoutError("the port takes no bytes: it stalls")
            time.sleep(DRAIN_POLL_S)

    def receive(self, seconds: float) -> bytes:
        if not self._port.is_open:
            raise SerialException("the port was closed")
        self._port.timeout = max(seconds, 0.0)
        first = self._port.read(1)
        return first + self._port.read(min(self._port.in_waiting, CHUNK)) if first else b""

    def close(self) -> None:
        with suppress(Exception):  # the system would wait up to 30 s for bytes that nobody takes
            self._port.reset_output_buffer()
        self._port.close()


class _WithoutEcho:
    """A channel whose adapter sends back what it is sent, as some for RS485 do; drops that."""

    def __init__(self, way: ByteChannel) -> None:
        self._way = way
        self._owed = b""

    def send(self, data: bytes) -> None:
        self._owed = data  # an echo of before that never came is not awaited any more
        self._way.send(data)

    def receive(self, seconds: float) -> bytes:
        end = time.monotonic() + seconds
        while True:
            received = self._way.receive(max(end - time.monotonic(), 0.0))
            length = min(len(received), len(self._owed))
            if length and received[:length] == self._owed[:length]:
                self._owed, received = self._owed[length:], received[length:]
                if not received and time.monotonic() < end:
                    continue
            elif received:
                self._owed = b""
            return received

    def close(self) -> None:
        self._way.close()
