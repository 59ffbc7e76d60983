"""How much of some numbers is noise: robust deviations, and what is white in a sampled channel."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["ANY_MOTION", "robust_sigma", "white_noise"]

Array = NDArray[np.float64]

ANY_MOTION = range(2, 11)
"""Orders of differences for a channel of which nothing is known, not even how fast it moves."""

_TO_SIGMA = 1.4826  # standard deviation of normal noise over its median absolute one
_NEAR = 1.3  # of the least; two to four times the scatter of one order at a thousand samples


def robust_sigma(values: ArrayLike, *, centred: bool = False, axis: int | None = None) -> Array:
    """Return the standard deviation that normal noise of the same median size has.

    Args:
        values: residuals, (...,) [any unit]; those that are NaN are left out.
        centred: whether their median is taken off first; else it is the deviation about zero.
        axis: along which; all together where None.

    Returns:
        (...,) without that axis, a scalar where there is none [unit of the values].
    """
    values = np.asarray(values)
    if centred:
        values = values - np.nanmedian(values, axis=axis, keepdims=axis is not None)
    return _TO_SIGMA * np.asarray(np.nanmedian(np.abs(values), axis=axis))


def white_noise(
    values: Array,
    orders: Iterable[int] = ANY_MOTION,
    *,
    least: int = 12,
    sigma: Callable[[Array], float | Array] = robust_sigma,
) -> float:
    """Return the standard deviation of the white noise in an evenly sampled channel, in its unit.

    From differences, whose variance is binomial(2 m, m) times that of the noise at order m while a
    smooth motion dies out: the median over the orders that come near the least. Noise with a memory
    hides from differences. 0 where steps are so coarse that most differences vanish.

    Args:
        values: (n,) [any unit], NaN where not seen.
        orders: of the differences; one where it is known which the motion does not survive.
        least: differences of an order that must be seen for it to count.
        sigma: how the deviation of differences, (m,) [unit of the values], is taken; the robust
            one ignores impacts and glitches.

    Returns:
        The deviation; NaN where too few samples are seen.
    """
    found = []
    for order in orders:
        differences = np.diff(values, order)
        differences = differences[np.isfinite(differences)]
        if len(differences) >= least:
            found.append(float(sigma(differences)) / math.sqrt(math.comb(2 * order, order)))
    near = [one for one in found if one <= _NEAR * min(found)]
    return float(np.median(near)) if near else math.nan
