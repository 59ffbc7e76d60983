"""Clocks: what a driver waits with, so that a test or the virtual bench need not wait at all."""

from __future__ import annotations

import threading
import time
from typing import Protocol

__all__ = ["Clock", "SimulatedClock", "SystemClock"]


class Clock(Protocol):
    """A monotonic clock that can also wait."""

    def now(self) -> float:
        """Return the time [s]; it never goes back, its zero means nothing."""
        ...

    def sleep(self, seconds: float) -> None:
        """Return `seconds` later by this clock; zero and less return at once."""
        ...


class SystemClock:
    """The host's monotonic clock."""

    def now(self) -> float:
        """Return `time.monotonic()` [s]."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait in real time."""
        time.sleep(max(seconds, 0.0))


class SimulatedClock:
    """A clock that does not advance until someone sleeps; safe to share between threads.

    A driver and its simulated device share one, so that both agree on when things happened.

    Args:
        start: the first time that it shows [s].
    """

    def __init__(self, start: float = 0.0) -> None:
        self._time = start
        self._lock = threading.Lock()

    def now(self) -> float:
        """Return the simulated time [s]."""
        with self._lock:
            return self._time

    def sleep(self, seconds: float) -> None:
        """Advance the simulated time at once."""
        with self._lock:
            self._time += max(seconds, 0.0)
