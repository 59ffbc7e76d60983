"""Resampling from the take's own times to an even grid."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking.take import known, samples_of

__all__ = ["ABSENT", "even_grid", "nearest_sample", "on_grid", "stretches"]

Array = NDArray[np.float64]

ABSENT = -1
"""Index of the sample where a grid time has no frame of the take."""

_MOST_SAMPLES = 2_000_000
_NEAR = 0.6  # of a period; clocks jitter by less
_SAME = 0.01  # of a period


def even_grid(times: Array, rate: float) -> Array:
    """Return the even times that span a take, (k,) [s].

    Args:
        times: (n,) increasing [s].
        rate: [Hz].

    Raises:
        InputError: when the frame index jumps so far that no even grid can hold the take.
    """
    steps = round((times[-1] - times[0]) * rate)
    if steps > _MOST_SAMPLES:
        raise InputError(
            f"the take has {len(times)} samples over {times[-1] - times[0]:.6g} s at {rate:g} Hz: "
            "the frame index jumps too far; export the part that matters"
        )
    return times[0] + np.arange(steps + 1) / rate


def nearest_sample(times: Array, grid: Array, rate: float) -> NDArray[np.intp]:
    """Return the index of the sample nearest to each grid time, (k,), or ABSENT.

    Args:
        times: (n,) increasing [s].
        grid: (k,) [s].
        rate: of the grid [Hz].
    """
    right = np.clip(np.searchsorted(times, grid), 1, max(len(times) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(times) - 1)
    nearest = np.where(grid - times[left] <= times[right] - grid, left, right)
    near = np.abs(times[nearest] - grid) < _NEAR / rate
    return np.where(near, nearest, ABSENT)


def on_grid(
    times: Array, values: Array, grid: Array, source: NDArray[np.intp], longest_gap: float
) -> Array:
    """Return values, (k, d) [as given], at the grid times, NaN where that sample is not known.

    Samples that lie on the grid are taken as they are. Where a clock jitters, a cubic spline
    through the known samples moves them; it never runs across more than `longest_gap` [s].

    Args:
        times: (n,) increasing [s].
        values: (n, d) NaN where not known [any unit].
        grid: (k,) [s].
        source: (k,) as `nearest_sample` gives it.
        longest_gap: [s].
    """
    out = np.where((source == ABSENT)[:, None], np.nan, samples_of(values, source))
    off = np.abs(times[source] - grid) > _SAME * (grid[-1] - grid[0]) / max(len(grid) - 1, 1)
    if not off[source != ABSENT].any():
        return out
    sure = np.flatnonzero(known(values))
    given = known(out)
    for piece in np.split(sure, np.flatnonzero(np.diff(times[sure]) > longest_gap) + 1):
        if len(piece) < 2:
            continue
        spline = scipy.interpolate.CubicSpline(times[piece], values[piece])
        inside = given & (grid >= times[piece[0]]) & (grid <= times[piece[-1]])
        out[inside] = spline(grid[inside])
    return out


def stretches(seen: NDArray[np.bool_], longest_gap: int) -> list[tuple[int, int]]:
    """Return start and stop (one past the end) of the stretches without a long gap.

    Args:
        seen: (k,).
        longest_gap: longest gap within a stretch [samples].
    """
    index = np.flatnonzero(seen)
    if len(index) == 0:
        return []
    parted = np.flatnonzero(np.diff(index) > longest_gap + 1)
    starts = index[np.concatenate(([0], parted + 1))]
    stops = index[np.concatenate((parted, [len(index) - 1]))] + 1
    return [(int(a), int(b)) for a, b in zip(starts, stops, strict=True)]
