"""The lease: for how long the output may stay on without a sign of progress from the client.

Only the thread that works with the supply renews it, by asking for something or by waiting with
`LeaseClock`. No thread renews in the background: it would go on while the work hangs. While the
output is off the lease rests, so an operator may take an hour to answer a prompt.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from workbench.hw.clock import Clock, SystemClock

__all__ = ["ACKNOWLEDGE_S", "LEASE_S", "RENEW_S", "UNSET_ACKNOWLEDGE_S", "Lease", "LeaseClock"]

LEASE_S = 0.5
"""Without a sign of progress for so long the client counts as hung [s]."""
RENEW_S = 0.05
"""How often a waiting client renews [s]."""
ACKNOWLEDGE_S = 0.4
"""A guardian that acknowledges nothing for so long counts as dead [s]."""
UNSET_ACKNOWLEDGE_S = 5.0
"""The same before anything was set [s]: nothing is at stake then, and computers can be busy."""


class Lease:
    """The guardian's side: runs from the moment that the output may be on.

    Args:
        clock: monotonic, so that a step of the wall clock changes nothing.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._renewed = clock.now()
        self._running = False

    def begin(self) -> None:
        """Let it run from now on."""
        self._renewed = self._clock.now()
        self._running = True

    def renew(self) -> None:
        """Note a sign of progress."""
        self._renewed = self._clock.now()

    def rest(self) -> None:
        """Let it rest, as the output is off."""
        self._running = False

    @property
    def expired(self) -> bool:
        """Return whether the client showed no progress for too long while the output was on."""
        return self._running and self._clock.now() - self._renewed > LEASE_S


class LeaseClock(SystemClock):
    """The host's clock; waiting with it renews the lease of the supply that is held.

    Only in the thread that holds: another one that waits proves nothing about the work.
    """

    def __init__(self) -> None:
        self._renew: Callable[[float], None] | None = None
        self._holder = 0

    def hold(self, renew: Callable[[float], None]) -> None:
        """Renew by this from now on, whenever this thread waits.

        Args:
            renew: renews, then listens to the guardian for so long [s].
        """
        self._renew, self._holder = renew, threading.get_ident()

    def rest(self) -> None:
        """Renew nothing any more."""
        self._renew = None

    def sleep(self, seconds: float) -> None:
        """Wait in real time and renew meanwhile; raises whatever renewing raises."""
        until, renew = self.now() + seconds, self._renew
        if renew is None or threading.get_ident() != self._holder:
            time.sleep(max(seconds, 0.0))
            return
        while True:
            renew(min(max(until - self.now(), 0.0), RENEW_S))
            if self.now() >= until:
                return
