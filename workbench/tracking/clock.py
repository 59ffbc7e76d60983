"""Times of an export: rate, jitter, and whether indices and clock agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.source import Source

__all__ = ["column_rate", "is_rate", "jitter", "motive_times", "row_clock", "warn_of_index_steps"]

_TIME_TOLERANCE_S = 1e-3
_SNAP = 1e-4  # a printed step of 0.00833333 s is 120 Hz
_ORDINARY = 0.6  # of the usual step; larger ones are gaps that the index does not count
_PRINTED_S = 1e-9
_DECIMALS = (2, 3, 4)  # of clocks that are truncated; finer ones resolve each step
_ROUND_HZ = (10.0, 5.0, 1.0)
_APART = 2e-3  # relative difference from which a column has another rate than the stated one
_LEAST_ROWS = 3
_RATES_HZ = (0.1, 1e5)


def is_rate(rate: float) -> bool:
    """Return whether cameras may have a rate [Hz]; False for NaN."""
    return _RATES_HZ[0] <= rate <= _RATES_HZ[1]


def column_rate(
    indices: NDArray[np.int64], times: NDArray[np.float64], likely: float = 0.0
) -> float | None:
    """Return the rate of a time column over all its rows [Hz], None where it has none.

    The steps of a column that is truncated to milliseconds are 8, 8 and 9 ms at 120 Hz. So it is
    the number of frames over the time between them, without gaps that the index does not count;
    then the likely or the roundest rate within the resolution of the printed digits.

    Args:
        indices: (n,) frame indices.
        times: (n,) [s], NaN where blank.
        likely: a rate that is preferred to round ones [Hz].
    """
    advance, steps = np.diff(indices), np.diff(times)
    usable = (advance > 0) & np.isfinite(steps) & (steps >= 0)
    if not usable.any() or not steps[usable].sum() > 0:
        return None
    advance, steps = advance[usable], steps[usable]
    each, cut = steps / advance, _resolution(times)
    usual = float(np.median(each))
    ordinary = np.abs(each - usual) <= max(_ORDINARY * usual, 1.01 * cut)
    seconds = float(steps[ordinary].sum())
    if not seconds > 0:
        return None
    rate = float(advance[ordinary].sum()) / seconds
    within = max(_SNAP, cut / seconds) * rate
    if abs(rate - likely) < within:
        return likely
    for unit in _ROUND_HZ:
        near = unit * round(rate / unit)
        if near > 0 and abs(rate - near) < within:
            return float(near)
    return rate


def row_clock(
    indices: NDArray[np.int64], times: NDArray[np.float64], source: Source
) -> tuple[float, NDArray[np.float64]]:
    """Return the rate of a row format's clock [Hz] and the times (n,) [s].

    The times are the clock's own. Where it is truncated to milliseconds and fits an even rate
    within that, they are those of the frame index, which are more accurate.

    Args:
        indices: (n,) of the frames.
        times: (n,) of the file's clock [s].
        source: that is warned.

    Raises:
        TakeError: when the clock has too few samples or stands still.
    """
    rate = column_rate(np.arange(len(times)), times)
    by_index = column_rate(indices, times)
    if rate is None:
        raise source.fault(1, f"no rate can be found from {len(times)} frame(s); at least 2 needed")
    back = np.count_nonzero(np.diff(times) <= 0)
    if back:
        source.warn(f"the clock does not advance at {back} frame(s)")
    cut = _resolution(times)
    if by_index is not None and cut > 0 and len(times) >= _LEAST_ROWS:
        even = times[0] + (indices - indices[0]) / by_index
        off = np.abs(times - even)
        if off.max() <= 1.01 * cut and off.max() > 1e-6:
            source.warn(
                f"the clock is cut to {1e3 * cut:g} ms; times are frame index / {by_index:g} Hz"
            )
            return by_index, even
    return rate, times


def motive_times(
    indices: NDArray[np.int64], column: NDArray[np.float64] | None, rate: float, source: Source
) -> NDArray[np.float64]:
    """Return index / rate, (n,) [s]; warn where the time column has another rate or other times.

    The column of some Motive versions is truncated to milliseconds, so it is checked, not used.

    Args:
        indices: (n,) of the frames.
        column: (n,) the time column, NaN where blank [s]; None where there is none.
        rate: of the file's head [Hz].
        source: that is warned.
    """
    times = indices / rate
    if column is None:
        source.warn("no Time column; times are frame index / rate")
        return times
    apart = np.abs(column - times)
    known = np.flatnonzero(np.isfinite(apart))
    if not len(known) or apart[known].max() <= _TIME_TOLERANCE_S:
        return times
    worst = int(known[np.argmax(apart[known])])
    other = column_rate(indices, column) if len(known) >= _LEAST_ROWS else None
    text = (
        f"the Time column differs from frame / {rate:g} Hz by up to {apart[worst]:.4g} s, at frame "
        f"{indices[worst]}"
    )
    if other is not None and abs(other - rate) > _APART * rate:
        text += (
            f": its {len(known)} rows have {other:.6g} Hz. The rate of the header is used; if the "
            f"column is right, state it in the sheet, tracking: {{rate: {other:.6g} Hz}}"
        )
    source.warn(text)
    return times


def _resolution(times: NDArray[np.float64]) -> float:
    """Return the step to which a clock is truncated [s]: 0.01, 1e-3 or 1e-4; 0 where finer."""
    some = times[np.isfinite(times)]
    for decimals in _DECIMALS:
        cut = (np.abs(part - np.round(part, decimals)) <= _PRINTED_S for part in (some[:100], some))
        if all(each.all() for each in cut):
            return 10.0**-decimals
    return 0.0


def jitter(indices: NDArray[np.int64], times: NDArray[np.float64] | None) -> float:
    """Return the standard deviation of the clock's steps per frame about their median [s].

    Args:
        indices: (n,) of the frames.
        times: (n,) of the clock [s].
    """
    if times is None:
        return 0.0
    advance = np.diff(indices)
    usable = (advance > 0) & np.isfinite(np.diff(times))
    if not usable.any():
        return 0.0
    steps = np.diff(times)[usable] / advance[usable]
    return float(np.sqrt(np.mean((steps - np.median(steps)) ** 2)))


def warn_of_index_steps(indices: NDArray[np.int64], source: Source) -> None:
    """Warn of frame indices that jump, repeat or go back.

    Args:
        indices: (n,) of the frames.
        source: that is warned.
    """
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
