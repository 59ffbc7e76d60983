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
from numpy.typing import NDArray

from workbench.tracking.take import time_last

__all__ = ["LEAST_SEEN", "smooth_stretch"]

_ORDER = 3
LEAST_SEEN = _ORDER + 1
"""Seen samples that a stretch needs: fewer leave the curve undetermined or nothing to smooth."""


def smooth_stretch(
    values: NDArray[np.float64], seen: NDArray[np.bool_], cutoff: float, rate: float
) -> NDArray[np.float64]:
    """Return the smooth curve through a stretch, (k, d) [as given], also where nothing was seen.

    Args:
        values: (k, d) evenly sampled; ignored at samples not seen [any unit].
        seen: (k,) at least `LEAST_SEEN` of them True.
        cutoff: frequency of gain one half [Hz], below half the rate.
        rate: [Hz].
    """
    from workbench.tracking.loops import smooth

    penalty = (2 * np.sin(np.pi * cutoff / rate)) ** (-2 * _ORDER)
    return smooth(time_last(values), seen, penalty).T
