"""A line between two processes of this computer: JSON objects over a loopback socket."""

from __future__ import annotations

import json
import selectors
import socket
import threading
import time
from collections.abc import Mapping
from typing import Any

__all__ = ["HERE", "Message", "MessageLine"]

HERE = "127.0.0.1"
Message = dict[str, Any]  # what JSON can say
_CHUNK = 65536
_LONGEST = 1 << 20  # bytes of a line; whoever sends more is no process of ours


class MessageLine:
    """One end of the link, one object a line; several threads may send, one receives.

    Args:
        link: a connected socket, closed with this.
    """

    def __init__(self, link: socket.socket) -> None:
        link.settimeout(None)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._link = link
        self._selector = selectors.DefaultSelector()
        self._selector.register(link, selectors.EVENT_READ)
        self._sending = threading.Lock()
        self._buffer = b""

    def send(self, message: Mapping[str, Any]) -> None:
        """Send one object.

        Raises:
            OSError: when the other end is gone.
        """
        data = json.dumps(message).encode() + b"\n"
        with self._sending:
            self._link.sendall(data)

    def receive(self, timeout: float) -> Message | None:
        """Return the next object, or None when none is complete within `timeout` [s].

        Raises:
            OSError: when the other end is gone.
        """
        deadline = time.monotonic() + timeout
        while b"\n" not in self._buffer:
            if not self._selector.select(max(deadline - time.monotonic(), 0.0)):
                return None
            data = self._link.recv(_CHUNK)
            if not data:
                raise ConnectionResetError("the other end closed the link")
            self._buffer += data
            if len(self._buffer) > _LONGEST:
                raise ConnectionResetError("the other end sends no lines")
        line, _, self._buffer = self._buffer.partition(b"\n")
        try:
            message = json.loads(line)
        except ValueError:  # a Ctrl-C cut it; what was asked for is asked for again
            return {}
        return message if isinstance(message, dict) else {}

    def close(self) -> None:
        """Close the link."""
        self._selector.close()
        self._link.close()
