"""Two signals on one clock: sub-sample delays, and the clocks of cameras and bench.

A delay between two motions follows from a signal that they share. The rate of a clock does not: a
motor that turns too fast and a clock that runs too slow make the same rotor angle. Events separate
them: when the motor starts, changes its speed and stops.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import ROTOR_ANGLE
from workbench.timeseries import TimeSeries
from workbench.tracking.autocorrelation import block_covariance, correlation_time, time_blocks

__all__ = ["ClockFit", "Delay", "clock_fit", "delay"]

Array = NDArray[np.float64]

_BLOCKS = 10
_LEAST = 60
_COARSE_S = 0.002
_ROUNDS = 30
_DONE_S = 1e-9
_SCALES = np.array([1e-2, 1.0, 1.0, 1e-3])
_DIFF_STEP = 1e-5
_MOST_TRIES = 60
_MOST_RESIDUAL_RAD = 1.0  # a rotor that follows its commands has a tenth of a radian
_LAG_GUESS_S = 0.05
_LOWEST = np.array([-np.inf, np.log(1e-3), np.log(1e-3), -0.1])  # of what `_Clock` searches
_HIGHEST = np.array([np.inf, np.log(10.0), np.log(10.0), 0.1])
_AFTER_STOP_S = 0.1
_PPM = 1e6


@dataclass(frozen=True)
class Delay:
    """Delay of one signal against another.

    Args:
        seconds: positive where the first is late.
        standard_error: [s], from blocks in time.
        left: root mean square of the residual, in the signal's unit.
    """

    seconds: float
    standard_error: float
    left: float


@dataclass(frozen=True)
class ClockFit:
    """The cameras' clock against the bench's, from the rotor's response to its commands.

    A bench time t happens at the cameras' time offset + (1 + rate) t. The motor follows its command
    with a first-order lag, which may differ between driven and switched off.

    Args:
        offset_s: time of the output's switching on by the cameras' clock, without the motor's lag.
        offset_error_s: its standard error.
        drift_ppm: rate in parts per million; None where the stop is not in the take.
        drift_error_ppm: its standard error.
        lag_s: of the motor while driven.
        speed_ratio: rotor speed over commanded speed.
        left_rad: root mean square of the angle's residual.
    """

    offset_s: float
    offset_error_s: float
    drift_ppm: float | None
    drift_error_ppm: float | None
    lag_s: float
    speed_ratio: float
    left_rad: float


def delay(
    real: TimeSeries, twin: TimeSeries, channel: str, start: float, stop: float, most: float = 0.05
) -> Delay:
    """Return how much later `real` is than `twin` in one channel.

    A cubic spline through the twin is shifted until the squares of the difference are least; level
    and size of the two may differ. A coarse search comes first, Gauss-Newton steps then.

    Args:
        real: with valid samples of the channel; gaps do no harm.
        twin: likewise, and smooth: simulated, or `Track.motion`. Noise in it would draw the shift
            towards half samples, where a spline averages it. Its gaps are bridged.
        channel: name; one that oscillates. The rotor's angle grows evenly and shows no delay.
        start: of the part of `real` to look at [s].
        stop: its end [s].
        most: the greatest shift looked for [s].

    Raises:
        InputError: too few samples in common, or none of the shifts fits best inside `most`.
    """
    known = twin.validity(channel)
    t = real.times
    inside = real.validity(channel) & (t >= max(start, twin.times[0] + most))
    inside &= t <= min(stop, twin.times[-1] - most)
    if np.count_nonzero(inside) < _LEAST or np.count_nonzero(known) < _LEAST:
        raise InputError(
            f"{channel}: {np.count_nonzero(inside)} samples from {start:g} to {stop:g} s lie in "
            f"both motions; a delay needs {_LEAST}"
        )
    curve = scipy.interpolate.CubicSpline(twin.times[known], twin[channel][known])
    t, values = t[inside], real[channel][inside]
    shift = _coarse(curve, t, values, most)
    terms, residual = _linear(curve, t, values, shift)
    for _ in range(_ROUNDS):
        step = float(np.linalg.lstsq(terms, residual)[0][0])
        shift += step
        if abs(shift) > most:
            break
        terms, residual = _linear(curve, t, values, shift)
        if abs(step) < _DONE_S:
            break
    if abs(shift) >= most:
        raise InputError(f"{channel}: no shift within {most:g} s fits best; is it the same run?")
    covariance = block_covariance(terms, residual, time_blocks(t, _BLOCKS))
    return Delay(shift, float(np.sqrt(covariance[0, 0])), float(np.sqrt(np.mean(residual**2))))


def _coarse(curve: scipy.interpolate.CubicSpline, t: Array, values: Array, most: float) -> float:
    """Return the best of shifts 2 ms apart [s]."""
    shifts = np.arange(-most, most + _COARSE_S / 2, _COARSE_S)
    squares = [np.sum(_linear(curve, t, values, shift)[1] ** 2) for shift in shifts]
    return float(shifts[np.argmin(squares)])


def _linear(
    curve: scipy.interpolate.CubicSpline, t: Array, values: Array, shift: float
) -> tuple[Array, Array]:
    """Return the terms shift, size and level, (n, 3), and the residual of the last two, (n,)."""
    shape = np.column_stack([curve(t - shift), np.ones_like(t)])
    scale, residual = _fit(shape, values)
    return np.column_stack([-scale[0] * curve(t - shift, 1), shape]), residual


def _fit(shape: Array, values: Array) -> tuple[Array, Array]:
    solution = np.asarray(np.linalg.lstsq(shape, values)[0], dtype=np.float64)
    return solution, values - shape @ solution


def clock_fit(motion: TimeSeries, steps: Sequence[tuple[float, float]]) -> ClockFit:
    """Fit offset and rate of the cameras' clock to the rotor's angle and the commanded speeds.

    The start and the stop of the motor fix two times on both clocks; steps between them add theirs.
    The speed ratio is fitted beside, so a motor that is off its calibration does not look like a
    clock that drifts. Once-a-turn sway of the tip is fitted with it.

    Args:
        motion: its rotor angle, on the cameras' clock from any zero.
        steps: (bench time [s], commanded speed [rad/s]) from the output on to the last, speed 0.

    Raises:
        InputError: no steps, too few samples of the rotor's angle, or an angle that does not follow
            the steps.
    """
    seen = motion.validity(ROTOR_ANGLE)
    t, angle = motion.times[seen], motion[ROTOR_ANGLE][seen]
    if len(steps) < 2 or len(t) < _LEAST or not any(speed for _, speed in steps):
        raise InputError(
            f"{len(steps)} commanded step(s) and {len(t)} samples of the rotor's angle; clocks "
            f"need a start and a stop and {_LEAST} samples"
        )
    stops = steps[-1][1] == 0.0 and t[-1] > steps[-1][0] + _AFTER_STOP_S
    if not stops:
        t, angle = t[t < steps[-1][0]], angle[t < steps[-1][0]]
    guess = np.array([0.0, np.log(_LAG_GUESS_S), np.log(_LAG_GUESS_S), 0.0])
    free = len(guess) if stops else 2

    def residuals(x: Array) -> Array:
        return _fit(_terms(t, angle, steps, _Clock(*x, *guess[len(x) :])), angle)[1]

    found = scipy.optimize.least_squares(
        residuals,
        guess[:free],
        bounds=(_LOWEST[:free], _HIGHEST[:free]),
        x_scale=_SCALES[:free],
        diff_step=_DIFF_STEP,
        max_nfev=_MOST_TRIES,
    )
    clock = _Clock(*found.x, *guess[free:])
    solution, residual = _fit(_terms(t, angle, steps, clock), angle)
    if np.sqrt(np.mean(residual**2)) > _MOST_RESIDUAL_RAD:
        raise InputError(
            "the rotor's angle does not follow the commanded steps; did the robot fall, or is it "
            "another run?"
        )
    errors = _errors(t, residual, found.jac, free + len(solution))
    return ClockFit(
        offset_s=clock.offset,
        offset_error_s=float(errors[0]),
        drift_ppm=clock.rate * _PPM if stops else None,
        drift_error_ppm=float(errors[3]) * _PPM if stops else None,
        lag_s=float(np.exp(clock.log_lag)),
        speed_ratio=float(solution[0]),
        left_rad=float(np.sqrt(np.mean(residual**2))),
    )


def _errors(t: Array, residual: Array, jac: Array, fitted: int) -> Array:
    """Return standard errors from the Jacobian and the effective number of samples."""
    correlated = max(1.0, correlation_time(t, residual) / float(np.median(np.diff(t))))
    variance = float(residual @ residual) / max(1, len(t) - fitted) * correlated
    try:
        return np.sqrt(np.diag(np.linalg.inv(jac.T @ jac)) * variance)
    except np.linalg.LinAlgError:
        raise InputError(
            "the rotor's angle does not respond to the commanded steps; are they of this take?"
        ) from None


class _Clock(NamedTuple):
    """Parameters of the fit: offset [s], logarithms of both lags [log s], rate."""

    offset: float
    log_lag: float
    log_lag_off: float
    rate: float


def _terms(t: Array, angle: Array, steps: Sequence[tuple[float, float]], clock: _Clock) -> Array:
    """Return the commanded angle, the start angle and the sway once and twice a turn, (n, 6)."""
    turned, speed = _driven((t - clock.offset) / (1 + clock.rate), steps, clock)
    sway = speed / max(abs(w) for _, w in steps)
    waves = [f(k * angle) * sway for k in (1, 2) for f in (np.cos, np.sin)]
    return np.column_stack([turned, np.ones_like(t), *waves])


def _driven(
    bench: Array, steps: Sequence[tuple[float, float]], clock: _Clock
) -> tuple[Array, Array]:
    """Return angle and speed of a motor with a first-order lag, at bench times."""
    angle, speed = np.zeros_like(bench), np.zeros_like(bench)
    at_angle, at_speed = 0.0, 0.0
    begins = [begin for begin, _ in steps]
    edges = np.append(np.searchsorted(bench, begins), len(bench))
    for k, (begin, wanted) in enumerate(steps):
        lag = np.exp(clock.log_lag_off if wanted == 0.0 else clock.log_lag)
        here = slice(edges[k], edges[k + 1])
        since = np.append(bench[here], begins[min(k + 1, len(steps) - 1)]) - begin
        decay = np.exp(-since / lag)
        turned = at_angle + wanted * since + (at_speed - wanted) * lag * (1 - decay)
        faster = wanted + (at_speed - wanted) * decay
        angle[here], speed[here] = turned[:-1], faster[:-1]
        at_angle, at_speed = float(turned[-1]), float(faster[-1])
    return angle, speed
