"""When something began, for all that gaps and glitches let one know."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["late_by"]

_WINDOW = 5  # samples
_MOST = 4  # of them: a glitch among them decides nothing


def late_by(times: NDArray[np.float64], away: NDArray[np.bool_], usual: float) -> float | None:
    """Return how much later than usual something began [s], negative before; None where never.

    It began between the last sample at rest and the first away, so a gap there counts for neither.

    Args:
        times: (n,) of the samples that were seen [s].
        away: (n,) whether it was away from its rest.
        usual: when it should have begun to be away [s].
    """
    if len(times) < _WINDOW:
        return None
    lasting = np.convolve(away, np.ones(_WINDOW), "valid") >= _MOST
    if not lasting.any():
        return None
    start = int(np.argmax(lasting))
    first = start + int(np.argmax(away[start : start + _WINDOW]))
    before = float(times[first - 1]) if first else float(times[0])
    return float(max(before - usual, 0.0) + min(times[first] - usual, 0.0))
