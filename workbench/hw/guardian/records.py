"""What a guardian writes down: events on disk before it goes on, the wire, and what it shouts."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from datetime import datetime

from workbench.hw.clock import Clock
from workbench.hw.guardian.messages import Records

__all__ = ["Recorder"]


class Recorder:
    """Writes one guardian's files; a disk that is full is remembered and never raises.

    Args:
        records: where to write.
        clock: stamps the events.

    Attributes:
        fault: the first error of writing an event; the output must not stay on unrecorded.
    """

    def __init__(self, records: Records, clock: Clock) -> None:
        self._records, self._clock = records, clock
        self.fault: OSError | None = None

    def event(self, event: str, **facts: object) -> None:
        """Append one event and wait until the disk has it."""
        if self._records.events is None:
            return
        wall = datetime.now().astimezone().isoformat(timespec="milliseconds")
        line = {"time_s": round(self._clock.now(), 6), "wall": wall, "event": event} | facts
        try:
            with self._records.events.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            self.fault = self.fault or error
            self.shout(f"{self._records.events} cannot be written: {error}")

    def wire(self, line: str) -> None:
        """Append one message of the wire.

        Raises:
            OSError: when it cannot be written; the link then sends nothing but off.
        """
        if self._records.wire is not None:
            with self._records.wire.open("a", encoding="utf-8") as file:
                file.write(line + "\n")

    def shout(self, text: str) -> None:
        """Tell the terminal, if there still is one."""
        with suppress(OSError, ValueError):
            sys.stderr.write(f"guardian: {text}\n")
            sys.stderr.flush()
