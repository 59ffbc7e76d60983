"""One run while its bundle grows: each line of its journal is read once."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from workbench.bundle import Bundle, Event, events, foreign, parse_line, sentence
from workbench.output import OutputState

__all__ = ["JournalTail", "Readings"]


@dataclass
class Readings:
    """What the supply said, in the order of time.

    Args:
        time_s: of the run [s].
        set_V: voltage that it is set to [V].
        volts: at its terminals [V].
        amps: that it gives [A].
    """

    time_s: list[float] = field(default_factory=list)
    set_V: list[float] = field(default_factory=list)
    volts: list[float] = field(default_factory=list)
    amps: list[float] = field(default_factory=list)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.amps)

    def between(self, first: int, end: int) -> dict[str, list[float]]:
        """Return those from a place up to another, as columns."""
        end = min(end, len(self))  # another thread may be adding one
        return {name: values[first:end] for name, values in vars(self).items()}

    def add(self, time_s: float, reading: events.SupplyReading) -> None:
        """Add a reading of the journal."""
        self.time_s.append(time_s)
        self.set_V.append(reading.set_voltage_V)
        self.volts.append(reading.voltage_V)
        self.amps.append(reading.current_A)


class JournalTail:
    """A bundle that is followed.

    Args:
        bundle: as it was when it was found.

    Attributes:
        readings: so far.
        notices: (time [s], sentence) of each event that is no reading; None before cameras record,
            with which the run's time begins.
        filming: whether the run's time has begun; it begins with the cameras.
        ended: whether the last line was written.
    """

    def __init__(self, bundle: Bundle) -> None:
        self.bundle = bundle
        self.readings = Readings()
        self.notices: list[tuple[float | None, str]] = []
        self.filming = self.ended = False
        self._at = 0
        self._last_s = 0.0
        self._changed = time.time()

    def read_on(self) -> bool:
        """Read what was added; return whether anything was."""
        if foreign(self.bundle.record.journal_log) is not None:
            return False
        try:
            with self.bundle.record.journal_log.open("rb") as file:
                file.seek(self._at)
                lines, _, _ = file.read().rpartition(b"\n")
            self._changed = self.bundle.record.journal_log.stat().st_mtime
        except FileNotFoundError:
            return False
        if not lines:
            return False
        self._at += len(lines) + 1
        for line in lines.splitlines():
            if (logged := parse_line(line)) is not None:  # else a full disk cut it
                self._take(*logged)
        return True

    @property
    def number(self) -> int | None:
        """Of the run in its protocol; None where its manifest does not say."""
        asked = self.bundle.manifest.asked
        return None if asked is None else asked.number

    @property
    def output(self) -> OutputState:
        """What is known of the supply's output by all that was written so far."""
        return self.bundle.record.output

    @property
    def run_s(self) -> float:
        """Time of the run [s], 0 before the cameras record."""
        if not self.filming:
            return 0.0
        return self._last_s + (0.0 if self.ended else max(time.time() - self._changed, 0.0))

    def _take(self, time_s: float, event: Event) -> None:
        self._last_s = time_s
        match event:
            case events.SupplyReading():
                self.readings.add(time_s, event)
                return
            case events.CamerasStarted():
                self.filming = True
            case events.Complete() | events.Stopped():
                self.ended = True
        self.notices.append((time_s if self.filming else None, sentence(event)))
