"""The log of all bytes on a wire, and the memory of whether it could be written."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Literal

from workbench.hw.clock import Clock

__all__ = ["Way", "WireLog", "Wiretap"]

WireLog = Callable[[str], None]  # takes one JSON line: time_s, way, bytes
Way = Literal["sent", "received", "discarded"]


class Wiretap:
    """Writes each message on a wire as one JSON line, bytes in hex.

    Args:
        wire_log: takes the lines.
        clock: stamps them.

    Attributes:
        fault: why the log could not be written, once it could not.
    """

    def __init__(self, wire_log: WireLog, clock: Clock) -> None:
        self._wire_log = wire_log
        self._clock = clock
        self.fault: Exception | None = None

    def note(self, way: Way, data: bytes) -> None:
        """Write one message; a log that cannot be written is remembered, not raised."""
        line = {"time_s": round(self._clock.now(), 6), "way": way, "bytes": data.hex(" ")}
        try:
            self._wire_log(json.dumps(line))
        except Exception as error:  # a full disk must not keep the output on
            self.fault = error
