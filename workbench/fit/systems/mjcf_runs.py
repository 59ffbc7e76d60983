"""What was measured of a mechanism, and what acted on it: channels, inputs, runs.

Samples are even and of one rate in all runs; one that was not seen is NaN. Inputs have stamps of
their own: between two samples of the outputs the *mean* of the input over that time acts, whatever
its own rate, so that the momentum it gives is exact and a delay of a fraction of a sample shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.glitches import glitches
from workbench.noise import white_noise

__all__ = [
    "Channel",
    "Input",
    "JointStart",
    "MjcfRun",
    "channel_noise",
    "common_sample",
    "held_control",
    "sound_values",
]

Array = NDArray[np.float64]
Hold = Literal["zero", "first"]

_KEPT = 64  # runs
_UNEVEN = 0.1  # of a sample that a stamp may be off
_LEAST = 12  # samples of a run
_RATE_TOLERANCE = 1e-3
_FIRST = 9  # samples that determine a moving start
_WEAK = 10.0  # standard errors: the prior of a start that was read from the data themselves


@dataclass(frozen=True)
class Channel:
    """One measured quantity.

    Args:
        name: as it is reported.
        of: a joint's position or speed, or the place of a site or a body along `axis`.
        owner: name of the joint, site or body.
        axis: unit vector in the world, of a place.
        sigma: standard deviation of its noise [SI]; None estimates it from the data.
        memory: correlation of its noise with that of the sample before [1].
    """

    name: str
    of: Literal["position", "speed", "site", "body"]
    owner: str
    axis: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), kw_only=True)
    sigma: float | None = field(default=None, kw_only=True)
    memory: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True)
class Input:
    """One recorded control.

    Args:
        name: as it is reported.
        actuator: that it drives.
        hold: between its stamps: `zero` keeps the last value, `first` draws a line.
    """

    name: str
    actuator: str
    hold: Hold = "first"


@dataclass(frozen=True)
class JointStart:
    """Where a joint is when a run starts, and how fast; a deviation of zero says that it is known.

    Args:
        position: [rad] or [m].
        position_deviation: of its prior.
        speed: [rad/s] or [m/s].
        speed_deviation: of its prior.
    """

    position: float = 0.0
    position_deviation: float = 0.0
    speed: float = 0.0
    speed_deviation: float = 0.0

    @classmethod
    def seen(cls, times: Array, values: Array, sigma: float) -> JointStart:
        """Return the start at the first stamp that a parabola through the first samples shows.

        Args:
            times: (n,) [s].
            values: (n,) of the joint's position [m, rad], NaN where not seen.
            sigma: of their noise.

        Raises:
            InputError: when too few of the samples were seen.
        """
        known = np.flatnonzero(np.isfinite(values))[:_FIRST]
        if len(known) < _FIRST:
            raise InputError(f"a start is read from {_FIRST} samples; only {len(known)} were seen")
        powers = np.vander(times[known] - times[0], 3, increasing=True)
        found = np.linalg.lstsq(powers, values[known], rcond=None)[0]
        spread = _WEAK * sigma * np.sqrt(np.diag(np.linalg.inv(powers.T @ powers)))
        return cls(float(found[0]), float(spread[0]), float(found[1]), float(spread[1]))


@dataclass(frozen=True, eq=False)
class MjcfRun:
    """One run of a mechanism.

    Args:
        name: for messages.
        times: (n,) [s]; the start holds at time zero, samples before it are not used.
        values: (n, c) of the channels [SI], NaN where not seen.
        start: joint -> where it starts; one that is not named starts as the model says, at rest.
        input_times: (m,) [s] of the same clock; before and after, an input stays as it was.
        inputs: (m, i) of the inputs [SI].
        late_deviation: how far time zero may be off [s]; zero says that it is known.
    """

    name: str
    times: Array
    values: Array
    start: Mapping[str, JointStart] = field(default_factory=dict)
    input_times: Array = field(default_factory=lambda: np.zeros(1))
    inputs: Array = field(default_factory=lambda: np.zeros((1, 0)))
    late_deviation: float = 0.0

    def __post_init__(self) -> None:
        """Refuse samples that are not even.

        Raises:
            InputError: with the run and the stamp.
        """
        if len(self.times) < _LEAST:
            raise InputError(
                f"{self.name}: {len(self.times)} samples; a run needs at least {_LEAST}"
            )
        even = self.times[0] + self.sample_s * np.arange(len(self.times))
        worst = int(np.argmax(np.abs(self.times - even)))
        if not abs(self.times[worst] - even[worst]) <= _UNEVEN * self.sample_s:
            raise InputError(
                f"{self.name}: stamp {self.times[worst]:g} s is more than {_UNEVEN:g} of a sample "
                f"of {self.sample_s:g} s from an even clock; resample, or give samples that are "
                "missing as NaN"
            )
        if (np.diff(self.input_times) <= 0).any() or not np.isfinite(self.inputs).all():
            raise InputError(
                f"{self.name}: the inputs' stamps must increase and every value must be known"
            )

    @property
    def sample_s(self) -> float:
        """Return the time from one sample to the next [s]."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))


def held_control(
    stamps: Array, values: Array, hold: Hold, edges: Array, delay: float = 0.0, lag: float = 0.0
) -> Array:
    """Return the constants, (n - 1,) [unit of the input], that act like a delayed, lagged input.

    Each is the mean m of the delayed, lagged input from edge to edge. Held, a sine of angular
    frequency w would act with 1 - (w T)^2 / 12 of its amplitude; so what is smooth, lines and what
    a lag made smooth, gives m less a twelfth of m's second difference, which keeps the momentum.
    The lag is first order, f' = (u - f) / lag, from the first stamp on.

    Args:
        stamps: (m,) [s], increasing.
        values: (m,) [unit of the input].
        hold: between the stamps.
        edges: (n,) evenly spaced [s].
        delay: [s].
        lag: time constant [s], not negative.
    """
    width, count = float(edges[1] - edges[0]), len(edges) - 1
    before = max(0, int(np.ceil((edges[0] - stamps[0]) / width))) + 2
    edges = edges[0] + width * np.arange(-before, len(edges) + 1)
    steps = np.diff(stamps)
    parts = values[:-1] * steps if hold == "zero" else (values[:-1] + values[1:]) / 2 * steps
    integral = np.concatenate([[0.0], np.cumsum(parts)])
    at = edges - delay
    inside = np.clip(at, stamps[0], stamps[-1])
    k = np.clip(np.searchsorted(stamps, inside, side="right") - 1, 0, max(len(steps) - 1, 0))
    since = inside - stamps[k]
    area = integral[k] + values[k] * since
    if hold == "first" and len(steps):
        area += (values[k + 1] - values[k]) / steps[k] * since**2 / 2
    area += values[0] * np.minimum(at - stamps[0], 0.0)
    area += values[-1] * np.maximum(at - stamps[-1], 0.0)
    mean = np.diff(area) / width
    keep = float(np.exp(-width / lag)) if lag > 0 else 0.0
    if lag > 0:
        rise = np.diff(np.interp(at, stamps, values)) if hold == "first" else 0.0
        # f at the interval's end, less keep f at its begin, where u is a line within it
        pushed = (1 - keep) * mean + rise * ((1 + keep) / 2 - lag / width * (1 - keep))
        ends = scipy.signal.lfilter([1.0], [1, -keep], pushed, zi=[keep * values[0]])[0]
        mean -= lag * np.diff(ends, prepend=values[0]) / width
    mean[1:-1] -= (1.0 if hold == "first" else keep) * np.diff(mean, 2) / 12
    return mean[before : before + count]


def common_sample(runs: Sequence[MjcfRun]) -> float:
    """Return the time from one sample to the next in all runs [s].

    Raises:
        InputError: when there is no run, or when their rates differ.
    """
    samples = [run.sample_s for run in runs]
    if not samples:
        raise InputError("a system needs at least one run")
    if max(samples) - min(samples) > _RATE_TOLERANCE * min(samples):
        rates = ", ".join(f"{run.name} {1 / run.sample_s:g} Hz" for run in runs)
        raise InputError(f"all runs must have one sample rate; they have {rates}; resample")
    return float(np.mean(samples))


def channel_noise(channels: Sequence[Channel], runs: Sequence[MjcfRun]) -> Array:
    """Return the stated noise, or the median of what the runs show, (c,) [unit of the channel].

    Raises:
        InputError: for a channel whose noise is neither stated nor found.
    """
    found = []
    for c, channel in enumerate(channels):
        sigma = channel.sigma
        if sigma is None:
            guesses = np.array([white_noise(run.values[:, c]) for run in runs])
            known = guesses[guesses > 0]
            sigma = float(np.median(known)) if len(known) else 0.0
        if not sigma > 0:
            raise InputError(
                f"channel {channel.name}: its noise cannot be found from the data; state it "
                "(a resolution divided by sqrt(12) where steps are all that shows)"
            )
        found.append(sigma)
    return np.array(found)


@lru_cache(_KEPT)
def sound_values(run: MjcfRun, sigma: tuple[float, ...]) -> Array:
    """Return what was seen in a run, (n, c) [SI], without glitches; nobody may change it.

    Args:
        run: with its values.
        sigma: of each channel's noise [SI].
    """
    return np.where(glitches(run.values, np.array(sigma)), np.nan, run.values)
