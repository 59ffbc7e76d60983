"""The clock of a guardian's supply: a trip cuts its waits short."""

from __future__ import annotations

import threading
import time

from workbench.hw.clock import SystemClock

__all__ = ["TripClock", "TrippedError"]


class TrippedError(Exception):
    """A wait of the supply was cut short by a trip."""


class TripClock(SystemClock):
    """Waits that a trip cuts short, until `calm`."""

    def __init__(self) -> None:
        self._tripped = threading.Event()
        self._calm = False

    def interrupt(self) -> None:
        """Cut waits short from now on."""
        self._tripped.set()

    def calm(self) -> None:
        """Wait as long as asked again: off has to be tried with pauses."""
        self._calm = True

    def sleep(self, seconds: float) -> None:
        """Wait in real time."""
        if self._calm:
            time.sleep(max(seconds, 0.0))
        elif self._tripped.wait(max(seconds, 0.0)):
            raise TrippedError
