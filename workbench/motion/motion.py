"""Channels of a motion of the robot, measured or simulated, and the quantities computed from it.

A track (from the cameras) and a twin (from the simulation) are both a `TimeSeries` with the
channels named here, so that one function serves both and the same estimator errors cancel.

Bench axes: x forward, y left, z up, metres; x = y = z = 0 is the foot's centre at rest. Angles turn
about +y (thesis, Appendix B): from +x towards -z. Time zero is the rotor's first motion, or the
release where nothing drives the robot.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple, get_args

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import require_named
from workbench.modes import DRIVEN, Mode
from workbench.timeseries import TimeSeries

__all__ = [
    "CORNER_FORCES",
    "DRIVEN",
    "FOOT",
    "FOOT_ERROR",
    "PITCH",
    "RELEASED",
    "ROTOR",
    "ROTOR_ANGLE",
    "ROTOR_SPEED",
    "TOP",
    "TOP_ERROR",
    "Misfit",
    "Mode",
    "Summary",
    "first_motion",
    "last_motion",
    "misfit",
    "position",
    "release",
    "rotor_angle",
    "rotor_speed",
    "seen_median",
    "summarize",
    "time_zero",
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
CORNER_FORCES = tuple(tuple(f"corner_{k}_{axis}_N" for axis in "xyz") for k in range(4))
"""Ground forces on the foot's corners, front left, front right, rear left, rear right; of a twin
with a free foot only, they are not measured on the robot."""
FOOT_ERROR, TOP_ERROR = "foot_error_mm", "top_error_mm"
"""Distance of foot and T from those of another motion, in the hopping plane."""
RELEASED: dict[Mode, tuple[str, str, str]] = {"decay": TOP, "drop": FOOT}
"""The point whose motion begins with the release."""

_REST_S = 0.5  # time at rest from which a zero is taken
_MOVED_RAD = 0.05  # ten times the angle noise of 0.2 mm markers on a 35 mm radius
_FIT_RAD = 1.5
_SPEED_WINDOW_S = 0.1
_SPUN_UP_S = 1.0
_INSTANT_S = 0.025

_HELD_S = 0.3  # the take begins with at least this much rest
_BEFORE_S = 0.5  # rest before a release that is part of its fit
_SEARCHED_S = 0.25  # longest time from a release to the end of its fit
_FIT_SHARE = 0.4  # of the usual displacement, up to which its beginning is fitted
_USUAL_PERCENTILE = 75  # nearly the greatest; the robot may be picked up before the take ends
_LEAST_MOVED = 5
_LEAST_MOVE_M = 0.0015  # five times the noise of a marker
_GRID = 100
_INSTANT_WITHIN_S = 1e-5


@dataclass(frozen=True)
class Summary:
    """Distance, hop height and speed of a run.

    Args:
        distance_m: forward travel of the foot from rest to the end of the drive.
        hop_height_m: median over the rotor's turns of the foot's greatest height in a turn.
        speed_rad_s: mean rotor speed from one second after its first motion.
    """

    distance_m: float
    hop_height_m: float
    speed_rad_s: float

    def as_json(self) -> dict[str, float]:
        """Return the values by name."""
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
    return np.where(seen, _slope(filled, window) / step, np.nan)


def _slope(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Return the slopes, (n,) [1/sample], of parabolas fitted to `window` values around each.

    The filter of Savitzky and Golay; within half a window of an end, the parabola of that end.
    `scipy.signal` has it as well, and takes 0.3 s to load.
    """
    half = window // 2
    index = np.arange(-half, half + 1)
    inside = np.correlate(values, index / (index @ index), "valid")
    first, last = (
        np.polyval(np.polyder(np.polyfit(index, end, 2)), index)
        for end in (values[:window], values[-window:])
    )
    return np.asarray(np.concatenate([first[:half], inside, last[half + 1 :]]), np.float64)


def first_motion(times: NDArray[np.float64], angle: NDArray[np.float64]) -> float | None:
    """Return the time of the rotor's first motion [s], or None when it never moves.

    The angle of a motor that starts at once grows with time, that of a uniformly accelerated one
    with its square; so time is fitted as t0 + a sqrt(angle) + b angle over the first part of a
    turn. The standard deviation of t0 is 1 to 3 ms for 0.2 mm of marker noise.

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


def release(times: NDArray[np.float64], path: NDArray[np.float64]) -> float | None:
    """Return when a held point was released [s], or None when it never moves.

    Without an initial velocity, and with forces that depend on the position, the displacement is an
    even function of the time since the release: c + a (t - t0)^2 - b (t - t0)^4 with b >= 0. This
    is fitted from 0.5 s before to 40 % of the usual displacement.

    Bias and scatter [ms] on motions of the twin at 120 Hz, 0.2 and 0.3 mm of noise in every
    coordinate, plain and through a zero-phase low-pass at 25 Hz: T held 16 mm away -1 and 2.5 to 4,
    43 mm away -1 and 1, 4 mm away -4 to 0 and 7 to 11; the foot dropped by 10 to 50 mm -2 to 0 and
    0.6 to 2.4 (`tests/motion/test_motion.py`). The thesis' low-pass at 9 Hz makes a drop 5 to 16 ms
    early; a hand that trembles by 1 mm at 1 to 6 Hz scatters it by 3 to 4 ms, and T at 16 mm by 11
    ms. Noise of 0.3 mm with an autocorrelation of 0.8 per frame scatters T at 4, 16 and 43 mm by
    25, 7 and 2.5 ms; at 4 mm the worst of 60 was 70 ms off.

    Args:
        times: (n,) [s], beginning with at least 0.3 s of rest.
        path: (n, 3) [m], NaN where not seen.
    """
    seen = np.isfinite(path).all(axis=1)
    t, path = times[seen], path[seen]
    if len(t) < _LEAST_MOVED:
        return None
    held = t <= t[0] + _HELD_S
    distance = np.asarray(np.linalg.norm(path - np.median(path[held], axis=0), axis=1))
    moved = distance[distance > _LEAST_MOVE_M]
    if len(moved) < _LEAST_MOVED:
        return None
    far = int(np.argmax(distance > _FIT_SHARE * np.percentile(moved, _USUAL_PERCENTILE)))
    end = t[far]
    rest = path[(t >= end - _BEFORE_S - _SEARCHED_S) & (t < end - _SEARCHED_S)]
    rest = np.median(rest if len(rest) else path[held], axis=0)
    direction = (path[far] - rest) / np.linalg.norm(path[far] - rest)
    window = (t >= end - _BEFORE_S) & (t <= end)
    return _onset(t[window], (path[window] - rest) @ direction)


def time_zero(mode: Mode, motion: TimeSeries) -> float | None:
    """Return the first motion of the rotor or the release [s], by the mode; None without either.

    Raises:
        InputError: when there is no such mode.
    """
    require_named("mode", mode, get_args(Mode))
    if mode in RELEASED:
        return release(motion.times, position(motion, RELEASED[mode]))
    return first_motion(motion.times, motion[ROTOR_ANGLE])


def last_motion(motion: TimeSeries) -> float:
    """Return when the rotor last turned at more than half its median speed [s].

    That is the end of the drive where it is not recorded. Time zero is the first motion.
    """
    driven = motion.times > 0
    speed = np.abs(np.where(motion.validity(ROTOR_SPEED), motion[ROTOR_SPEED], np.nan))[driven]
    turning = np.flatnonzero(speed > seen_median(speed) / 2)
    return float(motion.times[driven][turning[-1]]) if len(turning) else float(motion.times[-1])


def summarize(motion: TimeSeries, duration: float) -> Summary:
    """Return distance, hop height and speed; time zero is the first motion of the rotor.

    Args:
        motion: channels of this module.
        duration: end of the drive [s].
    """
    x, z = position(motion, FOOT)[:, 0], position(motion, FOOT)[:, 2]
    t, angle = motion.times, motion[ROTOR_ANGLE]
    return Summary(
        distance_m=seen_median(x[np.abs(t - duration) <= _INSTANT_S]) - _rest(t, x),
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


def _onset(t: NDArray[np.float64], moved: NDArray[np.float64]) -> float:
    """Return t0 of the even function that fits best [s] to displacements (n,) [m] at times (n,)."""

    def cost(zero: float) -> float:
        square = np.maximum(t - zero, 0.0) ** 2
        terms = np.column_stack([np.ones_like(t), square, square**2])
        coefficients = np.linalg.lstsq(terms, moved)[0]
        if coefficients[2] > 0:  # no restoring force: a uniform acceleration
            terms = terms[:, :2]
            coefficients = np.linalg.lstsq(terms, moved)[0]
        return float(np.sum((terms @ coefficients - moved) ** 2))

    grid = np.linspace(max(t[0], t[-1] - _SEARCHED_S), t[-1], _GRID)
    best = int(np.argmin([cost(zero) for zero in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, _GRID - 1)]
    return float(np.asarray(scipy.optimize.fminbound(cost, low, high, xtol=_INSTANT_WITHIN_S)))


def _rest(t: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    return seen_median(y[t <= 0])


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
    """Return the median of the finite values, NaN where there are none.

    Args:
        values: (n,) [any unit].
    """
    seen = values[np.isfinite(values)]
    return float(np.median(seen)) if len(seen) else float("nan")


def _mean(values: NDArray[np.float64]) -> float:
    seen = values[np.isfinite(values)]
    return float(np.mean(seen)) if len(seen) else float("nan")
