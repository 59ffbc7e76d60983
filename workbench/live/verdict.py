"""When a prediction error stops a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from workbench.fit import LONGEST
from workbench.schemas import StopWhen

__all__ = ["LimitMonitor", "Stop"]

_SAME_S = 1e-6


@dataclass(frozen=True)
class Stop:
    """Why a run stops.

    Args:
        error_m: prediction error at that instant [m].
        since_s: for how long it has been above the limit [s].
        time_s: of the sample, from the first frame by the cameras' clock [s].
    """

    error_m: float
    since_s: float
    time_s: float


class LimitMonitor:
    """Detects from errors, one after the other, when a limit was passed for too long.

    An error that is at the limit or below begins the count anew; a sample of which nothing is known
    says neither. More samples than a glitch lasts have to be above.

    Args:
        limit: of the protocol.
    """

    def __init__(self, limit: StopWhen) -> None:
        self._limit = limit
        self._since: float | None = None
        self._above = 0

    def after(self, time_s: float, error_m: float) -> Stop | None:
        """Take the error of a sample, NaN where it is not known, and return whether to stop."""
        if math.isnan(error_m):
            return None
        if error_m <= self._limit.above_m:
            self._since, self._above = None, 0
            return None
        self._since = time_s if self._since is None else self._since
        self._above += 1
        long = time_s - self._since
        if long < self._limit.for_s - _SAME_S or self._above <= LONGEST:
            return None
        return Stop(error_m, long, time_s)
