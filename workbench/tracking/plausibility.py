"""Hints that the axes, the units or the bodies of a track are wrong."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT, ROTOR, TOP, position, seen_median
from workbench.timeseries import TimeSeries
from workbench.tracking.axes import Axes
from workbench.tracking.floor import Floor
from workbench.tracking.missing import runs

__all__ = ["fall", "implausible"]

_TOP_ABOVE_M = (0.05, 1.0)
_ARM_M = (0.01, 0.2)
_TRAVEL_M = 0.05
_AT_START_S = 0.1
_GRAVITY_M_S2 = 9.81
_NEAR_M_S2 = 2.5  # T sways against the foot while both fall
_RIGHT_M_S2 = 0.5
_BENDING = 7  # samples of a local parabola
_LEAST_FLIGHT_S = 0.06  # a robot that sways at twice 17 rad/s stays near a peak for 0.04 s
_LEAST_FLYING = 12
_AGREED = 0.95  # length of the mean direction
_TILT_DEG = 3.0


def implausible(motion: TimeSeries, axes: Axes, floor: Floor | None) -> list[str]:
    """Return warnings, as whole sentences, for a motion as `make_track` lays it out.

    Args:
        motion: channels of `workbench.motion`.
        axes: how the export's axes were said to lie; warnings name the export's.
        floor: as `fit_floor` found it.
    """
    foot, top, rotor = (position(motion, names) for names in (FOOT, TOP, ROTOR))
    rest = motion.times <= max(0.0, float(motion.times[0]) + _AT_START_S)
    return [
        *_above(foot[rest], top[rest]),
        *_arm(top, rotor),
        *_direction(foot),
        *_gravity(motion.times, (foot + top) / 2, axes),
        *_tilt(floor),
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


def fall(times: NDArray[np.float64], path: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the acceleration of free flights, (3,) [m/s^2], or None where there are none.

    A flight is 0.06 s or more in which a point accelerates by about 9.81 m/s^2. A robot that rocks
    or is clamped does so too now and then, in changing directions and by changing amounts; so
    directions must agree, and their mean must be 9.81 m/s^2.

    Args:
        times: (n,) evenly spaced [s].
        path: (n, 3) of a point near the middle of the robot [m], NaN where not seen.
    """
    if len(times) < _BENDING:
        return None
    period = float(np.median(np.diff(times)))
    around = np.arange(_BENDING) - _BENDING // 2
    kernel = 2 * np.linalg.pinv(np.vander(around, 3))[0] / period**2  # of a fitted parabola
    bent = np.column_stack([np.convolve(column, kernel, "valid") for column in path.T])
    size = np.linalg.norm(bent, axis=1)
    flying = np.abs(np.nan_to_num(size) - _GRAVITY_M_S2) < _NEAR_M_S2
    flights = [bent[a:b] for a, b in runs(flying) if (b - a) * period >= _LEAST_FLIGHT_S]
    if sum(map(len, flights)) < _LEAST_FLYING:
        return None
    found = np.concatenate(flights)
    directions = found / np.linalg.norm(found, axis=1, keepdims=True)
    agreed = np.linalg.norm(directions.mean(axis=0)) > _AGREED
    mean = np.asarray(found.mean(axis=0))
    right = abs(np.linalg.norm(mean) - _GRAVITY_M_S2) < _RIGHT_M_S2
    return mean if agreed and right else None


def _gravity(times: NDArray[np.float64], middle: NDArray[np.float64], axes: Axes) -> list[str]:
    """Warn where flights fall another way than down."""
    falls = fall(times, middle)
    if falls is None:
        return []
    down = falls / np.linalg.norm(falls)
    tilt = float(np.degrees(np.arccos(np.clip(-down[2], -1.0, 1.0))))
    if tilt < _TILT_DEG:
        return []
    in_export = axes.points_to_export(down)
    along = int(np.argmax(np.abs(in_export)))
    letter = "xyz"[along]
    points, opposite = (letter, f"-{letter}") if in_export[along] > 0 else (f"-{letter}", letter)
    if opposite == axes.up:
        return [f"gravity in flight is tilted by {tilt:.0f} deg. Check the cameras' ground plane."]
    return [f"gravity points along export axis {points}: try up: {opposite}."]


def _tilt(floor: Floor | None) -> list[str]:
    if floor is None:
        return []
    slopes = [(floor.slope_x_rad, floor.slope_x_error_rad, "forward")]
    if floor.slope_y_rad is not None and floor.slope_y_error_rad is not None:
        slopes.append((floor.slope_y_rad, floor.slope_y_error_rad, "to the left"))
    return [
        f"the floor rises by {np.degrees(slope):.1f} +- {np.degrees(error):.1f} deg {way}; nothing "
        "was corrected. Check the cameras' ground plane and whether the floor is level."
        for slope, error, way in slopes
        if abs(slope) > np.radians(_TILT_DEG) and abs(slope) > 3 * error
    ]
