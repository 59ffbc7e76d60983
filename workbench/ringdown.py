"""What a robot did after its release: how far it was let go from, how it rang, how that faded.

The same estimator serves track and twin, so that its errors cancel in the difference.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from workbench.motion import FOOT, TOP, Mode, position, seen_median
from workbench.timeseries import TimeSeries

__all__ = ["Ring", "RingDown", "ring", "summarize_release"]

_LANDED_S = 0.5  # after the release of a drop the foot stands on the ground
_END_S = 0.5
_LEAST_SAMPLES = 60
_LOWEST_HZ = 0.5
_HIGHEST_HZ = 12.0
_PADDING = 8  # the spectrum is sampled so much finer than the record's own lines
_FASTEST_DECAY = 10.0  # [1/s]
_FIRST_DECAY = 0.1  # [1/s]
_LEAST_AMPLITUDE_M = 2e-4  # below this, markers show noise


@dataclass(frozen=True)
class RingDown:
    """What a released robot did, in three numbers; NaN where it cannot be told.

    Args:
        displacement_m: decay: how far forward of the centre of its swings T was held; drop: how far
            the foot fell, from the hand to its rest on the ground.
        ring_hz: frequency of the strongest swing of T, forward in decay, upward after a drop.
        damping_ratio: of that swing, as if its damping were viscous. The twin, pulled by 16 mm, has
            0.36 %; told are 0.36 % after 5 or 10 s, but 0.28 % after 2 s and nothing after 1 s.
    """

    displacement_m: float
    ring_hz: float
    damping_ratio: float

    def as_json(self) -> dict[str, float]:
        """Return the numbers under their names."""
        return asdict(self)


class Ring(NamedTuple):
    """A fading swing: its frequency [Hz], damping ratio, and what it swings about [m]."""

    hz: float
    damping_ratio: float
    centre: float


def summarize_release(motion: TimeSeries, mode: Mode, duration: float) -> RingDown:
    """Tell displacement, frequency and damping of a motion whose time zero is the release.

    Args:
        motion: channels of `workbench.motion`.
        mode: `decay` or `drop`.
        duration: how long it is looked at [s].
    """
    t, top, foot = motion.times, position(motion, TOP), position(motion, FOOT)
    if mode == "decay":
        swings = (t >= 0) & (t <= duration)
        found = ring(t[swings], top[swings, 0])
        return RingDown(seen_median(top[t < 0, 0]) - found.centre, found.hz, found.damping_ratio)
    swings = (t >= _LANDED_S) & (t <= duration)
    found = ring(t[swings], top[swings, 2])
    ended = (t >= min(duration, t[-1]) - _END_S) & (t <= duration)
    fall = seen_median(foot[t < 0, 2]) - seen_median(foot[ended, 2])
    return RingDown(fall, found.hz, found.damping_ratio)


def ring(times: NDArray[np.float64], path: NDArray[np.float64]) -> Ring:
    """Return the strongest of two fading swings fitted to a path; NaN where nothing rings.

    The robot has two modes below 20 Hz; fitted alone, the strong one would take the other's swing
    for damping. Frequencies start at the spectrum's highest lines, between 0.5 and 12 Hz; the
    amplitudes and the centre are linear and found for each trial (variable projection).

    Args:
        times: (n,) evenly spaced [s].
        path: (n,) [m], NaN where not seen.
    """
    seen = np.isfinite(path)
    t, x = times[seen], path[seen]
    if len(t) < _LEAST_SAMPLES:
        return Ring(np.nan, np.nan, np.nan)
    t = t - t[0]
    first = _fitted(t, x, [_highest_line(t, x)])
    both = _fitted(t, x, [*_poles(first), _highest_line(t, _left(first, t, x))])
    poles = _poles(both)
    swings = _amplitudes(poles, t, x)
    amplitude, hz, decay = max(
        (float(np.hypot(*swings[1 + 2 * k : 3 + 2 * k])), hz, decay)
        for k, (hz, decay) in enumerate(poles)
    )
    if amplitude < _LEAST_AMPLITUDE_M:
        return Ring(np.nan, np.nan, float(swings[0]))
    omega = 2 * np.pi * hz
    return Ring(hz, decay / float(np.hypot(omega, decay)), float(swings[0]))


Pole = tuple[float, float]
"""Frequency of a swing [Hz] and the rate at which it fades [1/s]."""


def _poles(parameters: NDArray[np.float64]) -> list[Pole]:
    return [(float(hz), float(decay)) for hz, decay in parameters.reshape(-1, 2)]


def _terms(poles: list[Pole], t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centre's column and each swing's cosine and sine, (n, 1 + 2 m)."""
    columns = [np.ones_like(t)]
    for hz, decay in poles:
        fading, phase = np.exp(-decay * t), 2 * np.pi * hz * t
        columns += [fading * np.cos(phase), fading * np.sin(phase)]
    return np.column_stack(columns)


def _amplitudes(
    poles: list[Pole], t: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.asarray(np.linalg.lstsq(_terms(poles, t), x)[0], dtype=np.float64)


def _left(
    parameters: NDArray[np.float64], t: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what the swings leave of the path, (n,) [m]."""
    poles = _poles(parameters)
    return x - _terms(poles, t) @ _amplitudes(poles, t, x)


def _fitted(
    t: NDArray[np.float64], x: NDArray[np.float64], start: list[Pole]
) -> NDArray[np.float64]:
    """Return frequencies and rates that leave least, (2 m,)."""
    low, high = [_LOWEST_HZ, 0.0] * len(start), [_HIGHEST_HZ, _FASTEST_DECAY] * len(start)
    begin = np.clip(np.ravel(start), np.array(low) + 1e-6, np.array(high) - 1e-6)
    return least_squares(_left, begin, bounds=(low, high), args=(t, x), x_scale=0.1).x


def _highest_line(t: NDArray[np.float64], x: NDArray[np.float64]) -> Pole:
    even = np.linspace(t[0], t[-1], len(t))
    windowed = (np.interp(even, t, x) - np.mean(x)) * np.hanning(len(t))
    count = _PADDING * len(t)
    hz = np.fft.rfftfreq(count, even[1] - even[0])
    allowed = (hz >= _LOWEST_HZ) & (hz <= _HIGHEST_HZ)
    spectrum = np.abs(np.fft.rfft(windowed, count))[allowed]
    return float(hz[allowed][np.argmax(spectrum)]), _FIRST_DECAY
