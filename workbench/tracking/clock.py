"""Times of an export: rate, jitter, and whether indices and clock agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.source import Source

__all__ = ["jitter", "motive_times", "row_rate", "warn_of_index_steps"]

_TIME_TOLERANCE_S = 1e-3
_SNAP = 1e-4  # a printed step of 0.00833333 s is 120 Hz


def row_rate(times: NDArray[np.float64], source: Source) -> float:
    """Return the rate of a clock column [Hz]: one over the median step, rounded if that near.

    Raises:
        TakeError: when the clock has too few samples or stands still.
    """
    steps = np.diff(times)
    steps = steps[np.isfinite(steps)]
    if len(steps) == 0 or np.median(steps) <= 1e-9:
        raise source.fault(1, f"no rate can be told from {len(times)} frame(s); at least 2 needed")
    if np.any(steps <= 0):
        source.warn(f"the clock does not advance at {np.count_nonzero(steps <= 0)} frame(s)")
    rate = 1.0 / float(np.median(steps))
    return float(round(rate)) if abs(rate - round(rate)) < _SNAP * rate else rate


def motive_times(
    indices: NDArray[np.int64],
    column: NDArray[np.float64] | None,
    rate: float,
    source: Source,
) -> NDArray[np.float64]:
    """Return index / rate, (n,) [s]; warn where the time column differs by more than 1 ms.

    The column of some Motive versions is cut to milliseconds, so it is checked, not used.
    """
    times = indices / rate
    if column is None:
        source.warn("no Time column; times are frame index / rate")
        return times
    apart = np.abs(column - times)
    apart = apart[np.isfinite(apart)]
    if len(apart) and apart.max() > _TIME_TOLERANCE_S:
        source.warn(
            f"the Time column differs from frame / {rate:g} Hz by up to {apart.max():.4g} s; "
            "frame / rate is used"
        )
    return times


def jitter(indices: NDArray[np.int64], times: NDArray[np.float64] | None) -> float:
    """Return the standard deviation of the clock's steps per frame about their median [s]."""
    if times is None:
        return 0.0
    advance = np.diff(indices)
    usable = (advance > 0) & np.isfinite(np.diff(times))
    if not usable.any():
        return 0.0
    steps = np.diff(times)[usable] / advance[usable]
    return float(np.sqrt(np.mean((steps - np.median(steps)) ** 2)))


def warn_of_index_steps(indices: NDArray[np.int64], source: Source) -> None:
    """Warn of frame indices that jump, repeat or go back."""
    steps = np.diff(indices)
    jumps = np.flatnonzero(steps > 1)
    if len(jumps):
        worst = int(jumps[np.argmax(steps[jumps])])
        source.warn(
            f"the frame index jumps {len(jumps)} time(s), most from {indices[worst]} "
            f"to {indices[worst + 1]}"
        )
    if np.any(steps < 1):
        at = int(np.flatnonzero(steps < 1)[0])
        source.warn(
            f"the frame index repeats or goes back {np.count_nonzero(steps < 1)} time(s), "
            f"first at frame {indices[at + 1]}"
        )
