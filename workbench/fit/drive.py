"""The drive is an input: the rotor's angle against T, as the cameras saw it.

What was commanded and what the motor did differ by a gain, a lag and a delay. That regression is
made without a simulation; what it leaves is smoothed without lag and added to it. What ripples with
the rotor's turns is estimated apart, for it is fast: smoothed so little that it passes, noise would
pass as well. The angle against T is the one in the world less T's turn, which the observer
estimates: two or three passes are made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["DriveFit", "calm", "commanded_angle", "fit_drive"]

Array = NDArray[np.float64]
Steps = Sequence[tuple[float, float]]

_LAG_S, _LEAST_LAG_S = 0.05, 1e-3
_ROBUST = 3.0  # residuals beyond so many deviations pull less
_WILD = 6.0  # deviations from the median of its neighbours: a glitch
_NEIGHBOURS = 7
_BENT = 0.1  # root mean square of what follows the turns and is not straight in time
_PASSES = 5  # of lag, smooth rest and ripple, each without the others; more change nothing
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
    """
    if turn is None:
        spread = max(0.3 / sigma, 1.0)  # T turns by some tenths of a radian
        found = _regressed(times, angle, steps, sigma, spread)
        return _fitted(found, _turned(times, steps, found.x))
    against, smooth, ripple = angle - turn, 0 * times, 0 * times
    found = _regressed(times, against, steps, sigma)
    for _ in range(_PASSES):
        usual = _turned(times, steps, found.x)
        # a glitch in the first samples, where lag and delay show, still pulls at them
        still = np.where(calm(against - usual, sigma), against - ripple, np.nan)
        found = _regressed(times, still, steps, sigma)
        usual = _turned(times, steps, found.x)
        turning = _rippled(times, usual, usual + smooth + ripple + turn)
        smooth, ripple = _smoothed(against - usual, turning, sigma, memory)
    return _fitted(found, usual + smooth + ripple)


def _fitted(found: Any, angle: Array) -> DriveFit:
    gain, lag, delay, _ = found.x
    deviation = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)))[:3]
    return DriveFit(float(gain), float(lag), float(delay), deviation, angle)


def _turned(times: Array, steps: Steps, x: Array) -> Array:
    """Return the angle of gain, lag, delay and offset (4,), (n,) [rad]."""
    return x[3] + commanded_angle(times, steps, x[0], x[1], x[2])


def _regressed(times: Array, angle: Array, steps: Steps, sigma: float, spread: float = 1.0) -> Any:
    """Return scipy's result for gain, lag, delay and offset of an angle, (n,), NaN where unseen."""
    seen = np.isfinite(angle)
    times, angle = times[seen], angle[seen]
    return scipy.optimize.least_squares(
        lambda x: (angle - _turned(times, steps, x)) / sigma,
        [1.0, _LAG_S, 0.0, float(angle[0])],
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


def _rippled(times: Array, usual: Array, angle: Array) -> Array:
    """Return what a speed that ripples once and twice a turn adds to an angle, (n, c) [rad].

    Of the four columns those remain that are not straight in time, as they are where the rotor
    hardly turns.

    Args:
        times: (n,) [s].
        usual: (n,) angle without ripple [rad].
        angle: (n,) of the rotor in the world [rad].
    """
    speed, step = np.gradient(usual, times), float(times[1] - times[0])
    rates = [speed * f(n * angle) for n in (1, 2) for f in (np.cos, np.sin)]
    every = scipy.integrate.cumulative_trapezoid(rates, dx=step, initial=0.0).T
    across, sizes, _ = np.linalg.svd(scipy.signal.detrend(every, axis=0), full_matrices=False)
    return np.asarray(across[:, sizes > _BENT * np.sqrt(len(angle))])


def _smoothed(left: Array, turning: Array, sigma: float, memory: float) -> tuple[Array, Array]:
    """Return what is smooth in a remainder of even samples, (n,), and what follows the turns, (n,).

    Glitches and gaps do not count.

    The discrete smoothing spline of Whittaker: least squares with second differences D penalised by
    a strength s, chosen by restricted maximum likelihood, which rarely takes noise for smooth
    where cross-validation often does (Wood, J. R. Stat. Soc. B 73, 2011, 3). What follows the turns
    is not penalised: a ripple is no reason to believe the noise. Residuals are whitened: with a
    memory m of the noise, r[k] - m r[k-1] counts. Determinants are those without gaps, from the
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

    bands, difference = np.zeros((3, count)), (1.0, -2.0, 1.0)
    for i in range(3):
        for j in range(i, 3):
            bands[2 + i - j, j : count - 2 + j] += difference[i] * difference[j]
    turn = np.pi * np.arange(count) / count
    squares = (2 - 2 * np.cos(turn)) ** 2 / (1 + memory**2 - 2 * memory * np.cos(turn))
    rough = squares[2:]  # without what is straight, which no strength penalises
    every = np.column_stack([values, turning])
    goal = transposed(whitened(every))
    best, least = (values, values), np.inf
    for strength in _STRENGTHS:
        whole = strength * bands
        whole[2] += own**2 + np.append(before[1:] ** 2, 0.0)
        whole[1] += own * before
        smooth = scipy.linalg.solveh_banded(whole, goal)
        rest = goal.T @ (every - smooth)  # of the remainder and of each turning, whitened
        share = np.linalg.solve(rest[1:, 1:], rest[1:, 0])
        power = float(rest[0, 0] - rest[0, 1:] @ share)
        score = (len(rough) - len(share)) * np.log(power) + np.linalg.slogdet(rest[1:, 1:])[1]
        score += float(np.sum(np.log1p(1 / (strength * rough))))
        if score < least:
            best, least = (smooth[:, 0] - smooth[:, 1:] @ share, turning @ share), score
    return best
