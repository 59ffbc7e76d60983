"""What a guardian writes down: events on disk before it goes on, the wire, and what it shouts."""

from __future__ import annotations

import json
import os
import queue
import stat
import sys
import threading
from contextlib import suppress
from datetime import datetime

from workbench.hw.clock import Clock
from workbench.hw.guardian.messages import Records
from workbench.output import Ledger, OutputState, after

__all__ = ["EventRecorder"]

OF_THE_OUTPUT = frozenset({"taken", "output_on", "off", "terminals", "lost", "regained", "trip"})
"""The events that the supply's ledger keeps as well."""
LAST_WORDS_S = 2.0  # for a terminal to take what was said, once nothing else is to be done


class EventRecorder:
    """Writes one guardian's files; a disk that is full is remembered and never raises.

    Args:
        records: where to write.
        clock: stamps the events.

    Attributes:
        fault: the first error of writing an event; the output must not stay on unrecorded.
        output: what is known of the output by the events so far.
        ledger: of the supply, once it is known which one it is.
    """

    def __init__(self, records: Records, clock: Clock) -> None:
        self._records, self._clock = records, clock
        self._lock = threading.RLock()
        self.fault: OSError | None = None
        self.output = OutputState()
        self.ledger: Ledger | None = None
        self.address = ""
        self._released = False
        self._said: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._printer = threading.Thread(target=self._print, name="printer", daemon=True)
        self._printer.start()

    def event(self, event: str, **facts: object) -> None:
        """Append one event and wait until the disk has it."""
        with self._lock:
            self.output = after(self.output, {"event": event} | facts)
            if self._records.events is not None:
                self._append(event, facts)
            if self.ledger is not None and event in OF_THE_OUTPUT:
                self._keep(self.ledger, event, facts)

    def _append(self, event: str, facts: dict[str, object]) -> None:
        path = self._records.events
        assert path is not None
        wall = datetime.now().astimezone().isoformat(timespec="milliseconds")
        line = {"time_s": round(self._clock.now(), 6), "wall": wall, "event": event} | facts
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            self._failed(str(path), error)

    def _keep(self, ledger: Ledger, event: str, facts: dict[str, object]) -> None:
        record = None if self._records.events is None else str(self._records.events.parent)
        try:
            ledger.write(event, pid=os.getpid(), place=self.address, record=record, **facts)
        except OSError as error:
            self._failed(str(ledger.path), error)

    def _failed(self, path: str, error: OSError) -> None:
        error.filename = path
        self.fault = self.fault or error
        self.shout(f"{path} cannot be written: {error.strerror}")

    def wire(self, line: str) -> None:
        """Append one message of the wire.

        Raises:
            OSError: when it cannot be written; the link then sends nothing but off.
        """
        if self._records.wire is not None:
            with self._records.wire.open("a", encoding="utf-8") as file:
                file.write(line + "\n")

    def let_go(self) -> None:
        """Shout no more into a pipe: who reads its end waits for it; a terminal or a file stays."""
        with suppress(OSError, ValueError):
            if not self._released and stat.S_ISFIFO(os.fstat(sys.stderr.fileno()).st_mode):
                with open(os.devnull, "w", encoding="utf-8") as nowhere:
                    os.dup2(nowhere.fileno(), sys.stderr.fileno())
            self._released = True

    def shout(self, text: str) -> None:
        """Print to the terminal, if there still is one, and wait for nothing: it may be stopped."""
        self._said.put(f"guardian: {text}\n")

    def close_terminal(self) -> None:
        """Shout no more; give the terminal a moment to take what was said."""
        self._said.put(None)
        self._printer.join(LAST_WORDS_S)

    def _print(self) -> None:
        """Write what is said, in a thread of its own: a stopped terminal takes nothing."""
        with suppress(OSError, ValueError, AttributeError):  # a program may have no terminal at all
            number = sys.stderr.fileno()
            while (text := self._said.get()) is not None:
                data = text.encode(sys.stderr.encoding, "backslashreplace")
                with suppress(OSError):
                    while data:
                        data = data[os.write(number, data) :]
