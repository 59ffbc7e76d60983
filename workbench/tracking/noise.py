"""The noise of each channel: at rest, from sample to sample, and beside the rotor's harmonics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import ROTOR_ANGLE, ROTOR_SPEED, last_motion
from workbench.noise import robust_sigma, white_noise
from workbench.timeseries import TimeSeries
from workbench.tracking.autocorrelation import block_covariance, correlation_time, time_blocks

__all__ = ["ChannelNoise", "Harmonics", "noise_floor", "synchronous"]

_TURN = 2 * np.pi
_SPUN_UP_S = 1.0
_BEFORE_END_S = 0.1
_REST_MARGIN_S = 0.02  # time zero is known to a few milliseconds
_LEAST_REST = 30
_LEAST_WHITE = 30
_ORDER = 6
_DRIFT = 2  # degree of the slow part: a hopper travels
_LEAST_TURNS = 4
_MOST_BLOCKS = 10
_centred_sigma = partial(robust_sigma, centred=True)


@dataclass(frozen=True)
class ChannelNoise:
    """The noise of one channel, standard deviations in its unit; None where unknown.

    Args:
        rest: about a line through the samples before time zero: cameras and floor.
        white: from third differences of the whole run: the part that changes from one sample to the
            next, which no motion below a quarter of the rate does.
        synchronous: over the steady part, beside the harmonics of the rotor and a slow drift:
            noise and motion that does not repeat from turn to turn.
        correlation_s: autocorrelation time of `synchronous` [s]; one sample's time when white.
        turns: of the rotor in the steady part.
    """

    rest: float | None
    white: float | None
    synchronous: float | None
    correlation_s: float | None
    turns: float

    def as_json(self, scale: float = 1.0) -> dict[str, float | None]:
        """Return the standard deviations times `scale`, and the correlation time [s]."""
        sigmas = {"rest": self.rest, "white": self.white, "synchronous": self.synchronous}
        scaled = {key: None if v is None else scale * v for key, v in sigmas.items()}
        return scaled | {"correlation_s": self.correlation_s}


class Harmonics(NamedTuple):
    """A channel over a window as harmonics of the rotor's angle phi.

    The channel is drift + Re sum over k of h_k exp(i k phi), h_0 real and at the window's middle.

    Args:
        coefficients: (order + 1,) complex h_k [unit of the channel].
        covariance: (2 order + 1, 2 order + 1) [that unit squared] of h_0, Re h_1, Im h_1, Re h_2,
            ... from blocks of whole turns or more, so that residuals may be autocorrelated.
        times: (n,) of the samples used [s].
        residual: (n,) of harmonics and drift [unit of the channel].
        turns: of the rotor in the window.
    """

    coefficients: NDArray[np.complex128]
    covariance: NDArray[np.float64]
    times: NDArray[np.float64]
    residual: NDArray[np.float64]
    turns: float


def noise_floor(
    raw: TimeSeries, start: float = _SPUN_UP_S, stop: float | None = None
) -> Mapping[str, ChannelNoise]:
    """Return the noise of each channel but the rotor's speed, which is a fit of its own.

    Args:
        raw: an unfiltered motion, time zero at the first motion, as `Track.raw`.
        start: of the steady part [s].
        stop: its end [s]; the end of the drive where not given.
    """
    end = last_motion(raw) - _BEFORE_END_S if stop is None else stop
    names = [name for name in raw.names if name != ROTOR_SPEED]
    return {name: _channel(raw, name, start, end) for name in names}


def synchronous(raw: TimeSeries, channel: str, order: int, start: float, stop: float) -> Harmonics:
    """Fit harmonics of the rotor's angle to a channel over a window by least squares.

    A slow parabola is fitted with them. Gaps do no harm.

    Args:
        raw: an unfiltered motion.
        channel: name.
        order: highest harmonic.
        start: of the window [s].
        stop: its end [s].

    Raises:
        InputError: channel and rotor are seen together over less than four turns.
    """
    both = raw.validity(channel) & raw.validity(ROTOR_ANGLE)
    inside = both & (raw.times >= start) & (raw.times <= stop)
    t, phi, values = raw.times[inside], raw[ROTOR_ANGLE][inside], raw[channel][inside]
    count = float(abs(phi[-1] - phi[0]) / _TURN) if len(t) else 0.0
    least = 2 * order + 1 + _DRIFT
    if count < _LEAST_TURNS or len(t) < _LEAST_TURNS * least:
        raise InputError(
            f"{channel} and the rotor are seen together over {count:.1f} turns and {len(t)} "
            f"samples from {start:g} to {stop:g} s; harmonics up to {order} need {_LEAST_TURNS} "
            f"turns and {_LEAST_TURNS * least} samples"
        )
    if channel == ROTOR_ANGLE:  # its deviation from uniform rotation, against that rotation
        values = values - np.polyval(np.polyfit(t, phi, 1), t)
        phi = phi - values
    terms = _terms(t, phi, order)
    solution = np.linalg.lstsq(terms, values)[0]
    residual = values - terms @ solution
    blocks = time_blocks(t, min(_MOST_BLOCKS, int(count)))
    size = 2 * order + 1
    coefficients = np.zeros(order + 1, dtype=np.complex128)
    coefficients[0] = solution[0]
    coefficients[1:] = solution[1:size:2] + 1j * solution[2:size:2]
    covariance = block_covariance(terms, residual, blocks)[:size, :size]
    return Harmonics(coefficients, covariance, t, residual, count)


def _terms(t: NDArray[np.float64], phi: NDArray[np.float64], order: int) -> NDArray[np.float64]:
    """Return 1, then cos and -sin of each harmonic, then the drift, (n, 2 order + 1 + 2)."""
    waves = [f(k * phi) for k in range(1, order + 1) for f in (np.cos, lambda x: -np.sin(x))]
    u = 2 * (t - t[0]) / (t[-1] - t[0]) - 1
    return np.column_stack([np.ones_like(t), *waves, *(u**k for k in range(1, _DRIFT + 1))])


def _channel(raw: TimeSeries, name: str, start: float, stop: float) -> ChannelNoise:
    valid = raw.validity(name)
    values = np.where(valid, raw[name], np.nan)
    rest = valid & (raw.times < -_REST_MARGIN_S)
    try:
        fit = synchronous(raw, name, _ORDER, start, stop)
    except InputError:
        return ChannelNoise(_rest(raw.times[rest], values[rest]), _white(values), None, None, 0.0)
    return ChannelNoise(
        rest=_rest(raw.times[rest], values[rest]),
        white=_white(values),
        synchronous=float(np.std(fit.residual)),
        correlation_s=correlation_time(fit.times, fit.residual),
        turns=fit.turns,
    )


def _rest(t: NDArray[np.float64], values: NDArray[np.float64]) -> float | None:
    """Return the robust standard deviation about a line."""
    if len(t) < _LEAST_REST:
        return None
    line = np.polyval(np.polyfit(t - t[0], values, 1), t - t[0])
    return float(_centred_sigma(values - line))


def _white(values: NDArray[np.float64]) -> float | None:
    """Return the noise that third differences show, robust against landings."""
    found = white_noise(values, (3,), least=_LEAST_WHITE, sigma=_centred_sigma)
    return found if np.isfinite(found) else None
