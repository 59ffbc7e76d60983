"""The drive is an input: the rotor's angle against T, as the cameras saw it.

What was commanded and what the motor did differ by a gain, a lag and a delay. That regression is
made without a simulation; what it leaves is smoothed without lag and added to it. What a motor may
do within each turn is estimated apart, for it is fast: smoothed so little that it passes, noise
would pass as well. The angle against T is the one in the world less T's turn, which the observer
estimates: two or three passes are made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.fit.spline import left_of, rests_of

__all__ = ["DriveFit", "Torque", "calm", "commanded_angle", "fit_drive", "motor_torque"]

Array = NDArray[np.float64]
Steps = Sequence[tuple[float, float]]
Torque = Callable[[Array], Array]
"""Angle of the rotor in the world, (n,) [rad] -> the motor's torque, (n,) [N m]."""

_LAG_S, _LEAST_LAG_S = 0.05, 1e-3
_ROBUST = 3.0  # residuals beyond so many deviations pull less
_WILD = 6.0  # deviations from the median of its neighbours: a glitch
_NEIGHBOURS = 7
_BENT = 0.03  # root mean square of what follows the turns and is not straight in time
_PASSES = 5  # of lag, smooth rest and ripple, each without the others; more change nothing
_SLOPE = 1000.0  # [rad/s per N m] of a column; its size is found
_ACCELERATION_S = 0.15  # over which T's acceleration is taken
_CHANCE = 8.0  # of -2 ln L: what one number gains by chance in one of 200 runs
_RIPPLES = np.append(0.0, np.geomspace(1.0, 300.0, 6))  # widths of a ripple's prior, by the noise
_STRENGTHS = np.geomspace(1e-2, 1e11, 53)  # a stronger one is straight over 10 s, and singular


@dataclass(frozen=True, eq=False)
class DriveFit:
    """What the motor did with its command.

    Args:
        gain: true over commanded speed.
        lag: time constant of the speed behind the command [s].
        delay: of the whole motion against the command's clock [s].
        deviation: (3,) standard errors of gain [1], lag and delay [s].
        angle: (n,) smoothed angle against T [rad].
    """

    gain: float
    lag: float
    delay: float
    deviation: Array
    angle: Array


def commanded_angle(times: Array, steps: Steps, gain: float, lag: float, delay: float) -> Array:
    """Return the angle that a motor with a lag has turned since its first command, (n,) [rad].

    Args:
        times: (n,) [s].
        steps: (time [s], commanded speed [rad/s]) in order of time; zero before the first.
        gain: true over commanded speed.
        lag: time constant of the speed behind the command [s].
        delay: [s].
    """
    angle, before = np.zeros_like(times), 0.0
    for begin, speed in steps:
        since = np.maximum(times - delay - begin, 0.0)
        angle += gain * (speed - before) * (since + lag * np.expm1(-since / lag))
        before = speed
    return angle


def fit_drive(
    times: Array,
    angle: Array,
    steps: Steps,
    sigma: float,
    turn: Array | None = None,
    memory: float = 0.0,
    torque: Torque | None = None,
) -> DriveFit:
    """Return what the motor did.

    Args:
        times: (n,) [s].
        angle: (n,) of the rotor in the world [rad], NaN where not seen.
        steps: as commanded.
        sigma: standard deviation of the angle's noise [rad].
        turn: (n,) of T [rad]; what the regression leaves beside it is kept, smoothed. None takes
            what it leaves for the turn of T.
        memory: correlation of the angle's noise with that of the sample before.
        torque: of the motor, under which its speed may fall.
    """
    if turn is None:
        spread = max(0.3 / sigma, 1.0)  # T turns by some tenths of a radian
        found = _regressed(times, angle, steps, sigma, spread)
        return _fitted(found, _turned(times, steps, found.x))
    against, smooth, ripple = angle - turn, 0 * times, 0 * times
    found = _regressed(times, against, steps, sigma)
    usual = _turned(times, steps, found.x)
    for _ in range(_PASSES):
        # a glitch in the first samples, where lag and delay show, still pulls at them
        still = np.where(calm(against - usual, sigma), against - ripple, np.nan)
        found = _regressed(times, still, steps, sigma, near=found.x)
        usual = _turned(times, steps, found.x)
        turning = _within_turns(times, usual, usual + smooth + ripple + turn, torque)
        smooth, ripple = _smoothed(against - usual, turning, sigma, memory)
    return _fitted(found, usual + smooth + ripple)


def _fitted(found: Any, angle: Array) -> DriveFit:
    gain, lag, delay, _ = found.x
    deviation = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)))[:3]
    return DriveFit(float(gain), float(lag), float(delay), deviation, angle)


def _turned(times: Array, steps: Steps, x: Array) -> Array:
    """Return the angle of gain, lag, delay and offset (4,), (n,) [rad]."""
    return x[3] + commanded_angle(times, steps, x[0], x[1], x[2])


def _slopes(times: Array, steps: Steps, x: Array) -> Array:
    """Return the derivatives of `_turned`, (n, 4) [rad, rad/s, rad/s, 1]."""
    gain, lag, delay, _ = x
    slopes, before = np.zeros((len(times), 4)), 0.0
    slopes[:, 3] = 1.0
    for begin, speed in steps:
        more, over = speed - before, np.maximum(times - delay - begin, 0.0) / lag
        faded = np.expm1(-over)
        slopes[:, 0] += more * lag * (over + faded)
        slopes[:, 1] += gain * more * (faded + over * (1 + faded))
        slopes[:, 2] += gain * more * faded
        before = speed
    return slopes


def _regressed(
    times: Array,
    angle: Array,
    steps: Steps,
    sigma: float,
    spread: float = 1.0,
    near: Array | None = None,
) -> Any:
    """Return scipy's result for gain, lag, delay and offset of an angle, (n,), NaN where unseen.

    It begins at those of `near`, (4,), where they are known.
    """
    seen = np.isfinite(angle)
    times, angle = times[seen], angle[seen]
    return scipy.optimize.least_squares(
        lambda x: (angle - _turned(times, steps, x)) / sigma,
        [1.0, _LAG_S, 0.0, float(angle[0])] if near is None else near,
        lambda x: -_slopes(times, steps, x) / sigma,
        loss="soft_l1",
        f_scale=_ROBUST * spread,
        bounds=([0.2, _LEAST_LAG_S, -0.5, -np.inf], [5.0, 2.0, 0.5, np.inf]),
        x_scale=[0.01, 0.01, 0.01, 0.01],
    )


def calm(left: Array, sigma: float) -> NDArray[np.bool_]:
    """Return which samples of a remainder, (n,), were seen and are no glitches.

    Args:
        left: (n,) remainder of an angle [rad], NaN where not seen.
        sigma: standard deviation of its noise [rad].
    """
    # mirrored: a repeated first sample would be its own median
    usual = scipy.ndimage.median_filter(np.nan_to_num(left), _NEIGHBOURS, mode="mirror")
    return np.asarray(np.isfinite(left) & (np.abs(left - usual) < _WILD * sigma))


def _within_turns(times: Array, usual: Array, angle: Array, torque: Torque | None) -> Array:
    """Return what may come to an angle within each turn, (n, c): orthonormal columns [1].

    A speed that ripples once and twice a turn, and one that falls under the motor's torque. Of
    these those remain that are not straight in time, as they are where the rotor hardly turns.

    Args:
        times: (n,) [s].
        usual: (n,) angle without them [rad].
        angle: (n,) of the rotor in the world [rad].
        torque: of the motor.
    """
    speed, step = np.gradient(usual, times), float(times[1] - times[0])
    rates = [speed * f(n * angle) for n in (1, 2) for f in (np.cos, np.sin)]
    if torque is not None:
        rates.append(_SLOPE * torque(angle) * (speed > 0))
    every = scipy.integrate.cumulative_trapezoid(rates, dx=step, initial=0.0).T
    across, sizes, _ = np.linalg.svd(scipy.signal.detrend(every, axis=0), full_matrices=False)
    return np.asarray(across[:, sizes > _BENT * np.sqrt(len(angle))])


def motor_torque(values: Mapping[str, float], path: Array, step: float) -> Torque:
    """Return the motor's torque by the rotor's angle: weight and inertia of the rotor about T.

    Args:
        values: numbers of the model.
        path: (n, 2) of T, forward and up [m], NaN where not seen.
        step: from one sample to the next [s].
    """
    index = np.arange(len(path))
    filled = np.column_stack(
        [np.interp(index, index[np.isfinite(c)], c[np.isfinite(c)]) for c in path.T]
    )
    filled = scipy.ndimage.median_filter(filled, (3, 1), mode="nearest")  # single glitches
    width = 2 * round(_ACCELERATION_S / step / 2) + 1
    x, z = scipy.signal.savgol_filter(filled, width, 3, deriv=2, delta=step, axis=0).T
    mass, arm, radius = values["rotor_mass"], values["rotor_arm_mass"], values["rotor_radius"]
    lever = (mass + arm / 2) * radius

    def torque(angle: Array) -> Array:
        turning = scipy.signal.savgol_filter(angle, width, 3, deriv=2, delta=step)
        across = -x * np.sin(angle) - (z + values["gravity"]) * np.cos(angle)
        return np.asarray(lever * across + (mass + arm / 3) * radius**2 * turning)

    return torque


def _smoothed(left: Array, turning: Array, sigma: float, memory: float) -> tuple[Array, Array]:
    """Return what is smooth in a remainder of even samples, (n,), and what follows the turns, (n,).

    Glitches and gaps do not count.

    The discrete smoothing spline of Whittaker: least squares with second differences D penalised by
    a strength s; what follows the turns has a normal prior. Of the strengths and widths of that
    prior that are about as likely as the likeliest, those with the fewest degrees of freedom are
    taken: whatever is followed without need is noise that shakes T. The likelihood is the
    restricted one, which rarely takes noise for smooth where cross-validation often does (Wood, J.
    R. Stat. Soc. B 73, 2011, 3). Residuals are whitened: with a memory m of the noise,
    r[k] - m r[k-1] counts. Determinants and degrees of freedom are those without gaps, from the
    eigenvalues of D'D and of the whitening.
    """
    kept = calm(left, sigma)
    count, values = len(left), np.where(kept, left, 0.0)
    after = kept & np.append(False, kept[:-1])
    own = np.where(after, 1.0, np.where(kept, np.sqrt(1 - memory**2), 0.0))
    before = np.where(after, -memory, 0.0)  # weights of sample k and of k - 1 in residual k

    def whitened(rest: Array) -> Array:
        return (own * rest.T + before * np.insert(rest, 0, 0.0, axis=0)[:-1].T).T

    def transposed(rest: Array) -> Array:
        return (own * rest.T + np.append((before * rest.T).T[1:], 0.0 * rest[:1], axis=0).T).T

    bands, difference = np.zeros((3, count)), (1.0, -2.0, 1.0)  # of D'D, by their distance
    for i in range(3):
        for j in range(i, 3):
            bands[j - i, j : count - 2 + j] += difference[i] * difference[j]
    turn = np.pi * np.arange(count) / count
    squares = (2 - 2 * np.cos(turn)) ** 2 / (1 + memory**2 - 2 * memory * np.cos(turn))
    rough = squares[2:]  # without what is straight, which no strength penalises
    every = np.column_stack([values, turning])
    goal, square = transposed(whitened(every)), own**2 + np.append(before[1:] ** 2, 0.0)
    rest = rests_of(_STRENGTHS, bands, square, own * before, every, goal)
    shown, ways = np.linalg.eigh(rest[:, 1:, 1:])
    along = (ways.mT @ rest[:, 1:, :1])[..., 0]
    stiff = _STRENGTHS[:, None] * rough
    wide = _RIPPLES[:, None, None]
    known = wide**2 / (1 + wide**2 * shown)  # (widths, strengths, c)
    score = len(rough) * np.log(rest[:, 0, 0] - np.sum(known * along**2, axis=2))
    score += np.log1p(1 / stiff).sum(axis=1) + np.log1p(wide**2 * shown).sum(axis=2)
    freedom = (1 / (1 + stiff)).sum(axis=1) + np.sum(known * shown, axis=2)
    freedom[score >= score.min() + _CHANCE] = np.inf
    j, i = np.unravel_index(np.argmin(freedom), freedom.shape)
    smooth = every - left_of(_STRENGTHS[i], bands, square, own * before, every, goal)
    share = ways[i] @ (known[j, i] * along[i])
    return smooth[:, 0] - smooth[:, 1:] @ share, turning @ share
