"""Samples that were seen but cannot be true: spikes, bursts, impossible distances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from workbench.tracking.take import known

__all__ = ["bursts", "out_of_reach", "spikes"]

_WINDOW = 5
_SPIKE_M = 4e-3  # a rotor at 21 rad/s leaves its running median by 0.5 mm at 120 Hz
_SPIKE_SCALES = 8.0
_FASTEST_M_S = 5.0  # the rotor moves at about 1 m/s
_BURST_S = 0.1


def spikes(path: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell samples far from the running median of five: (n,) True for one or two strays in a row.

    Far is 4 mm, or eight times the usual deviation where that is more.

    Args:
        path: (n, 3) [m], NaN where not seen.
    """
    seen = np.flatnonzero(known(path))
    found = np.zeros(len(path), dtype=bool)
    if len(seen) < _WINDOW:
        return found
    middle = median_filter(path[seen], size=(_WINDOW, 1), mode="nearest")
    apart = np.linalg.norm(path[seen] - middle, axis=1)
    usual = 1.4826 * float(np.median(apart))
    found[seen] = apart > max(_SPIKE_M, _SPIKE_SCALES * usual)
    return found


def bursts(times: NDArray[np.float64], path: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell short stretches between two jumps faster than 5 m/s, (n,).

    Args:
        times: (n,) increasing [s].
        path: (n, 3) [m], NaN where not seen.
    """
    seen = np.flatnonzero(known(path))
    found = np.zeros(len(path), dtype=bool)
    if len(seen) < 2:
        return found
    speed = np.linalg.norm(np.diff(path[seen], axis=0), axis=1) / np.diff(times[seen])
    pieces = np.split(seen, np.flatnonzero(speed > _FASTEST_M_S) + 1)
    longest = max(pieces, key=len)
    for piece in pieces:
        if piece is not longest and times[piece[-1]] - times[piece[0]] < _BURST_S:
            found[piece] = True
    return found


def out_of_reach(
    path: NDArray[np.float64], anchor: NDArray[np.float64], allowed: tuple[float, float]
) -> NDArray[np.bool_]:
    """Tell samples whose distance to an anchor is out of bounds, (n,).

    Args:
        path: (n, 3) [m], NaN where not seen.
        anchor: (n, 3) [m], NaN where not seen; nothing is told there.
        allowed: least and greatest distance [m].
    """
    distance = np.linalg.norm(path - anchor, axis=1)
    return (distance < allowed[0]) | (distance > allowed[1])
