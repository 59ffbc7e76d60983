"""Hints that the axes, the units or the bodies of a track are wrong."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT, ROTOR, TOP, position, seen_median
from workbench.timeseries import TimeSeries

__all__ = ["implausible"]

_TOP_ABOVE_M = (0.05, 1.0)
_ARM_M = (0.01, 0.2)
_TRAVEL_M = 0.05
_AT_START_S = 0.1


def implausible(motion: TimeSeries) -> list[str]:
    """Return warnings, as whole sentences, for a motion as `make_track` lays it out."""
    foot, top, rotor = (position(motion, names) for names in (FOOT, TOP, ROTOR))
    rest = motion.times <= max(0.0, float(motion.times[0]) + _AT_START_S)
    return [
        *_above(foot[rest], top[rest]),
        *_arm(top, rotor),
        *_direction(foot),
    ]


def _above(foot: NDArray[np.float64], top: NDArray[np.float64]) -> list[str]:
    height = seen_median((top - foot)[:, 2])
    if np.isnan(height) or _TOP_ABOVE_M[0] <= height <= _TOP_ABOVE_M[1]:
        return []
    return [
        f"T is {height:.3f} m above the foot at rest; {_TOP_ABOVE_M[0]:g} to {_TOP_ABOVE_M[1]:g} m "
        "are expected. Check the axis 'up', the units and the bodies' names."
    ]


def _arm(top: NDArray[np.float64], rotor: NDArray[np.float64]) -> list[str]:
    length = seen_median(np.linalg.norm(rotor - top, axis=1))
    if np.isnan(length) or _ARM_M[0] <= length <= _ARM_M[1]:
        return []
    return [f"the rotor is {length:.3f} m away from T; 0.035 m are usual. Check the bodies' names."]


def _direction(foot: NDArray[np.float64]) -> list[str]:
    seen = foot[np.isfinite(foot).all(axis=1)]
    if len(seen) < 2:
        return []
    x, y, z = seen[-1] - seen[0]
    if abs(z) > max(_TRAVEL_M, abs(x), abs(y)):
        return [f"the foot travels {z:.3f} m upwards. Check the axis 'up'."]
    if abs(y) > max(_TRAVEL_M, abs(x)):
        return [f"the foot travels {y:.3f} m sideways, {x:.3f} m forward. Check 'forward'."]
    if x < -_TRAVEL_M:
        return [f"the foot travels {-x:.3f} m backwards. Check 'forward' and the motor's polarity."]
    return []
