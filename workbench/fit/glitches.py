"""Samples that a sensor got wrong: a few in a row, far off a smooth path through their neighbours.

A glitch would kick the observed state, and the samples after it would be off as well. It is found
in what was seen alone: an observer that is followed by strong correction takes the kink of a
landing for one, loses the hop, and then takes the next one for the hop.

A block of up to `LONGEST` samples is set beside the cubic through two neighbours on either side. It
is off by what its nearest sample is, less what the cubic through the second and third neighbours is
off the first one: there a path that a landing kinks is not smooth, and one beside another glitch is
not either. The worst block is left out, and so on. Where a path jumps and stays, a few samples are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.fit.correction import LONGEST
from workbench.noise import robust_sigma

__all__ = ["glitches"]

Array = NDArray[np.float64]

_FAR = 7.0  # deviations of a sample that is left out
_SPAN = 12  # samples from the first neighbour to the last, gaps counted: beyond, nothing is smooth


def glitches(seen: Array, sigma: Array) -> NDArray[np.bool_]:
    """Return which samples are glitches, (n, c).

    Args:
        seen: (n, c) even samples [unit of the channel], NaN where not seen.
        sigma: (c,) standard deviation of the noise [unit of the channel].
    """
    columns = [_in_channel(one, float(s)) for one, s in zip(seen.T, sigma, strict=True)]
    return np.column_stack(columns) if columns else np.zeros(seen.shape, dtype=np.bool_)


def _in_channel(seen: Array, sigma: float) -> NDArray[np.bool_]:
    known = np.isfinite(seen)
    left = known.copy()
    off = _off(np.flatnonzero(left), seen, 1)[1]
    least = _FAR * max(sigma, float(robust_sigma(off)) if len(off) else 0.0)
    while True:
        worst, block = least, np.zeros(0, dtype=np.intp)
        for length in range(1, LONGEST + 1):
            at = np.flatnonzero(left)
            begins, off = _off(at, seen, length)
            if len(off) and off.max() > worst:
                worst, begin = off.max(), begins[off.argmax()]
                block = at[begin : begin + length]
        if not len(block):
            return known & ~left
        left[block] = False


def _off(at: NDArray[np.intp], seen: Array, length: int) -> tuple[NDArray[np.intp], Array]:
    """Return where blocks begin, in samples that are left, and how far each block is off."""
    begins = np.arange(3, len(at) - length - 2)
    before, after = begins[:, None] + (-3, -2, -1), begins[:, None] + length + (0, 1, 2)
    around = np.hstack([before, after])
    places, values = at[around].astype(float), seen[at[around]]
    inner, outer = slice(1, 5), [0, 1, 4, 5]
    inside, kinked = np.full(len(begins), np.inf), np.zeros(len(begins))
    for j in range(length):
        here = at[begins + j].astype(float)
        smooth = _cubic(places[:, inner], values[:, inner], here)
        apart = np.abs(smooth - _cubic(places[:, outer], values[:, outer], here))
        inside = np.minimum(inside, np.abs(seen[at[begins + j]] - smooth))
        kinked = np.maximum(kinked, apart)
    near = places[:, 5] - places[:, 0] <= _SPAN
    return begins, np.where(near, inside - kinked, -np.inf)


def _cubic(places: Array, values: Array, here: Array) -> Array:
    """Return the cubic through four points, (m, 4), at a place between, (m,), by Lagrange."""
    found = np.zeros(len(here))
    for k in range(4):
        weight = values[:, k].copy()
        for other in range(4):
            if other != k:
                weight *= (here - places[:, other]) / (places[:, k] - places[:, other])
        found += weight
    return found
