"""The motion of the robot, measured or simulated, and what is asked of it.

A track (from the cameras) and a twin (from the simulation) are both a `TimeSeries` with the
channels named here, so that one function serves both and the same estimator errors cancel.

Bench axes: x forward, y left, z up, metres; x = y = z = 0 is the foot's centre at rest. Angles turn
about +y (thesis, Appendix B): from +x towards -z. Time zero is the rotor's first motion.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from workbench.timeseries import TimeSeries

__all__ = [
    "FOOT",
    "PITCH",
    "ROTOR",
    "ROTOR_ANGLE",
    "ROTOR_SPEED",
    "TOP",
    "Misfit",
    "Summary",
    "first_motion",
    "last_motion",
    "misfit",
    "position",
    "rotor_angle",
    "rotor_speed",
    "seen_median",
    "summarize",
]

FOOT = ("foot_x_m", "foot_y_m", "foot_z_m")
"""The foot's centre of gravity."""
PITCH = "foot_pitch_rad"
"""Tilt of the foot, nose down; a track has it against its rest, a twin against the horizontal."""
TOP = ("top_x_m", "top_y_m", "top_z_m")
"""The point T, the tip of the beam."""
ROTOR = ("rotor_x_m", "rotor_y_m", "rotor_z_m")
"""The centre of the rotating mass."""
ROTOR_ANGLE = "rotor_angle_rad"
"""Unwrapped direction from T to the rotor in the world, not relative to the beam."""
ROTOR_SPEED = "rotor_speed_rad_s"

_REST_S = 0.5  # shortest still time that a zero is taken from
_MOVED_RAD = 0.05  # ten times the angle noise of 0.2 mm markers on a 35 mm radius
_FIT_RAD = 1.5
_SPEED_WINDOW_S = 0.1
_SPUN_UP_S = 1.0
_INSTANT_S = 0.025


@dataclass(frozen=True)
class Summary:
    """What a run did, in three numbers.

    Args:
        distance_m: forward travel of the foot from rest to the end of the drive.
        hop_height_m: median over the rotor's turns of the foot's greatest height in a turn.
        speed_rad_s: mean rotor speed from one second after its first motion.
    """

    distance_m: float
    hop_height_m: float
    speed_rad_s: float

    def as_json(self) -> dict[str, float]:
        """Return the numbers under their names."""
        return asdict(self)


class Misfit(NamedTuple):
    """Root mean square distance in the hopping plane between two motions [mm]."""

    foot_mm: float
    top_mm: float
    both_mm: float


def position(motion: TimeSeries, names: tuple[str, str, str]) -> NDArray[np.float64]:
    """Return a point's path, (n, 3) [m], NaN where it was not seen."""
    path = motion.select(names)
    return np.where(path.valid, path.values, np.nan)


def rotor_angle(top: NDArray[np.float64], rotor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unwrapped angle of the rotor about T, (n,) [rad], NaN where either was not seen.

    A gap longer than half a turn leaves the number of turns in it unknown.

    Args:
        top: (n, 3) positions of T [m].
        rotor: (n, 3) positions of the rotor [m].
    """
    arm = rotor - top
    angle = np.arctan2(-arm[:, 2], arm[:, 0])
    seen = np.isfinite(angle)
    angle[seen] = np.unwrap(angle[seen])
    return angle


def rotor_speed(times: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotor's speed, (n,) [rad/s], from a local parabola over 0.1 s; gaps stay NaN.

    Args:
        times: (n,) evenly spaced [s].
        angle: (n,) unwrapped [rad], NaN where not seen.
    """
    seen = np.isfinite(angle)
    if np.count_nonzero(seen) < 2:
        return np.full(len(angle), np.nan)
    step = float(np.median(np.diff(times)))
    window = max(5, 2 * round(_SPEED_WINDOW_S / step / 2) + 1)
    if len(angle) < window:
        return np.full(len(angle), np.nan)
    filled = np.interp(times, times[seen], angle[seen])
    speed = np.asarray(savgol_filter(filled, window, 2, deriv=1, delta=step))
    return np.where(seen, speed, np.nan)


def first_motion(times: NDArray[np.float64], angle: NDArray[np.float64]) -> float | None:
    """Return the time of the rotor's first motion [s], or None when it never moves.

    A motor that starts at once turns an angle in proportion to time, one that accelerates evenly in
    proportion to its square; so time is fitted as t0 + a sqrt(angle) + b angle over the first part
    of a turn, and t0 is the instant sought. 0.2 mm of marker noise leaves 1 to 3 ms.

    Args:
        times: (n,) [s].
        angle: (n,) unwrapped [rad], NaN where not seen.
    """
    seen = np.isfinite(angle)
    t, phi = times[seen], angle[seen]
    still = t <= t[0] + _REST_S if len(t) else seen[:0]
    if np.count_nonzero(still) < 2:
        return None
    moved = np.abs(phi - np.median(phi[still]))
    inside = np.flatnonzero(moved <= _MOVED_RAD)
    if len(inside) == 0 or inside[-1] == len(t) - 1:
        return None
    start = inside[-1] + 1
    beyond = np.flatnonzero(moved[start:] > _FIT_RAD)
    stop = start + (int(beyond[0]) if len(beyond) else len(t) - start)
    if stop - start < 4:
        return float(t[inside[-1]])
    phi = moved[start:stop]
    terms = np.column_stack([np.ones_like(phi), np.sqrt(phi), phi])
    zero = float(np.linalg.lstsq(terms, t[start:stop])[0][0])
    return min(zero, float(t[start]))


def last_motion(motion: TimeSeries) -> float:
    """Return when the rotor last turned at more than half its median speed [s].

    That is the end of the drive where nobody wrote it down. Time zero is the first motion.
    """
    driven = motion.times > 0
    speed = np.abs(np.where(motion.validity(ROTOR_SPEED), motion[ROTOR_SPEED], np.nan))[driven]
    turning = np.flatnonzero(speed > seen_median(speed) / 2)
    return float(motion.times[driven][turning[-1]]) if len(turning) else float(motion.times[-1])


def summarize(motion: TimeSeries, duration: float) -> Summary:
    """Tell distance, hop height and speed of a motion whose time zero is the first rotor motion.

    Args:
        motion: channels of this module.
        duration: end of the drive [s].
    """
    x, z = position(motion, FOOT)[:, 0], position(motion, FOOT)[:, 2]
    t, angle = motion.times, motion[ROTOR_ANGLE]
    return Summary(
        distance_m=_near(t, x, duration) - _rest(t, x),
        hop_height_m=_hop_height(t, z, angle, duration) - _rest(t, z),
        speed_rad_s=_mean_speed(t, np.where(motion.validity(ROTOR_ANGLE), angle, np.nan), duration),
    )


def misfit(real: TimeSeries, twin: TimeSeries, duration: float) -> Misfit:
    """Compare two motions on the times of the first, from zero to `duration` [s]."""
    real = real.between(0.0, duration)
    twin = twin.at(real.times)
    squares = [
        np.sum((position(real, point) - position(twin, point))[:, [0, 2]] ** 2, axis=1)
        for point in (FOOT, TOP)
    ]
    foot, top = (1000 * np.sqrt(_mean(square)) for square in squares)
    return Misfit(foot, top, 1000 * float(np.sqrt(_mean(np.concatenate(squares)))))


def _rest(t: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    return seen_median(y[t <= 0])


def _near(t: NDArray[np.float64], y: NDArray[np.float64], when: float) -> float:
    return seen_median(y[np.abs(t - when) <= _INSTANT_S])


def _hop_height(
    t: NDArray[np.float64], z: NDArray[np.float64], angle: NDArray[np.float64], duration: float
) -> float:
    driven = (t > 0) & (t <= duration) & np.isfinite(z) & np.isfinite(angle)
    if not driven.any():
        return float("nan")
    turn = np.floor(np.abs(angle[driven] - angle[driven][0]) / (2 * np.pi)).astype(int)
    return seen_median(np.array([z[driven][turn == k].max() for k in np.unique(turn)]))


def _mean_speed(t: NDArray[np.float64], angle: NDArray[np.float64], duration: float) -> float:
    steady = (t >= _SPUN_UP_S) & (t <= duration) & np.isfinite(angle)
    if np.count_nonzero(steady) < 2:
        return float("nan")
    return float(np.polyfit(t[steady], angle[steady], 1)[0])


def seen_median(values: NDArray[np.float64]) -> float:
    """Return the median of the finite values, NaN where there are none."""
    seen = values[np.isfinite(values)]
    return float(np.median(seen)) if len(seen) else float("nan")


def _mean(values: NDArray[np.float64]) -> float:
    seen = values[np.isfinite(values)]
    return float(np.mean(seen)) if len(seen) else float("nan")
