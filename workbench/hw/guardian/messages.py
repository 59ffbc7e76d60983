"""What client and guardian say to each other: JSON objects over a loopback socket, one a line.

    client                                  guardian
                                            {"token": "..."}
    {"id": 7, "call": "measure", "arguments": []}
                                            {"id": 7, "value": {...}}
                                            {"id": 7, "error": "HardwareError", "text": "..."}
    {"renew": 1}                            {"alive": 1}
                                            {"tripped": "why", "confirmed": true}
    {"goodbye": 1}                          (ends)

Every message of the client is a sign of progress.
"""

from __future__ import annotations

import json
import selectors
import socket
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import HardwareError, InputError, SafetyStop, WorkbenchError
from workbench.hw.connection import Connection

__all__ = ["NO_RECORDS", "Line", "Message", "Records", "Task", "error_of", "fault_of"]

Message = dict[str, Any]  # what JSON can say

_ERRORS: dict[str, type[WorkbenchError]] = {
    kind.__name__: kind for kind in (HardwareError, InputError, SafetyStop)
}
_CHUNK = 65536


@dataclass(frozen=True)
class Records:
    """Where a guardian writes.

    Args:
        wire: JSON line of each message on the wire; None keeps none.
        events: JSON line of each event of the guardian, on disk at once; None keeps none.
        latch: the supply's latch; None sets none.
    """

    wire: Path | None = None
    events: Path | None = None
    latch: Path | None = None


NO_RECORDS = Records()


@dataclass(frozen=True)
class Task:
    """What a guardian is started for.

    Args:
        connection: where the supply is.
        family: which driver to use.
        records: where to write.
        patience_s: how long to try to open the port, which its last owner may still hold [s].
        after: how the guardian before this one ended; empty when there was none.
    """

    connection: Connection
    family: str
    records: Records
    patience_s: float = 0.0
    after: str = ""

    def to_json(self) -> str:
        """Return it as one line."""
        return json.dumps(
            {
                "connection": vars(self.connection),
                "family": self.family,
                "records": {
                    name: str(path.resolve()) for name, path in vars(self.records).items() if path
                },
                "patience_s": self.patience_s,
                "after": self.after,
            }
        )

    @classmethod
    def from_json(cls, line: str) -> Task:
        """Return what `to_json` wrote."""
        found = json.loads(line)
        paths = {name: Path(path) for name, path in found["records"].items()}
        return cls(
            Connection(**found["connection"]),
            found["family"],
            Records(**paths),
            found["patience_s"],
            found["after"],
        )


class Line:
    """One end of the link; several threads may send, one receives.

    Args:
        link: a connected socket, closed with this.
    """

    def __init__(self, link: socket.socket) -> None:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._link = link
        self._selector = selectors.DefaultSelector()
        self._selector.register(link, selectors.EVENT_READ)
        self._sending = threading.Lock()
        self._heard = b""

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
        while b"\n" not in self._heard:
            if not self._selector.select(max(deadline - time.monotonic(), 0.0)):
                return None
            data = self._link.recv(_CHUNK)
            if not data:
                raise ConnectionResetError("the other end closed the link")
            self._heard += data
        line, _, self._heard = self._heard.partition(b"\n")
        try:
            message = json.loads(line)
        except ValueError:  # a Ctrl-C cut it; what was asked for is asked for again
            return {}
        return message if isinstance(message, dict) else {}

    def close(self) -> None:
        """Close the link."""
        self._selector.close()
        self._link.close()


def fault_of(error: WorkbenchError) -> Message:
    """Return an error as a message's part."""
    kind = next((name for name, kind in _ERRORS.items() if isinstance(error, kind)), "SafetyStop")
    return {"error": kind, "text": str(error)}


def error_of(message: Message) -> WorkbenchError:
    """Return the error that a message carries."""
    return _ERRORS[message["error"]](message["text"])
