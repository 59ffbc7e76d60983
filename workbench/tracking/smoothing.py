"""A low-pass of the seen samples only: penalised least squares over a stretch.

For samples y with weights w (1 seen, 0 not) it finds the curve s that makes

    sum w (y - s)^2 + lambda sum (third differences of s)^2

least (Whittaker 1923; Eilers 2003, "A perfect smoother"). Where everything was seen its gain is
1 / (1 + (sin(pi f / rate) / sin(pi cutoff / rate))^6): no delay, one half at the cutoff, as a
Butterworth of order 3 run forth and back. Unlike that one it needs no filled gaps, which could
distort the samples around them, and has no start-up transient.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["LEAST_SEEN", "smooth_stretch"]

_ORDER = 3
LEAST_SEEN = _ORDER + 1
"""Seen samples that a stretch needs: fewer leave the curve undetermined or nothing to smooth."""


def smooth_stretch(
    values: NDArray[np.float64], seen: NDArray[np.bool_], cutoff: float, rate: float
) -> NDArray[np.float64]:
    """Return the smooth curve through one stretch, (k, d), also where nothing was seen.

    Args:
        values: (k, d) evenly sampled; ignored at samples not seen.
        seen: (k,) at least `LEAST_SEEN` of them True.
        cutoff: frequency of gain one half [Hz], below half the rate.
        rate: [Hz].
    """
    penalty = (2 * np.sin(np.pi * cutoff / rate)) ** (-2 * _ORDER)
    bands = _roughness(len(values))
    bands *= penalty
    bands[-1] += seen
    known = np.where(seen[:, None], values, 0.0)
    in_place = {"overwrite_ab": True, "overwrite_b": True, "check_finite": False}
    return np.asarray(scipy.linalg.solveh_banded(bands, known, **in_place))


def _roughness(count: int) -> NDArray[np.float64]:
    """Return the upper bands of D'D, (4, count), where D takes third differences."""
    difference = scipy.special.binom(_ORDER, np.arange(_ORDER + 1)) * (-1.0) ** np.arange(
        _ORDER + 1
    )
    bands = np.zeros((_ORDER + 1, count), order="F")  # as LAPACK has them
    for apart in range(_ORDER + 1):
        for first in range(_ORDER + 1 - apart):
            second = first + apart
            product = difference[first] * difference[second]
            bands[_ORDER - apart, second : count - _ORDER + second] += product
    return bands
