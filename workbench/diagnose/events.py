"""How a robot hops, hop by hop, seen in the foot's path alone: the same for a track and a twin.

A hop that was followed for some seconds cannot be compared sample by sample; its hops can, as
distributions. The twin's path gets the cameras' noise, so that both pass the same estimator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.fit.measured import MeasuredRun
from workbench.motion import FOOT, position
from workbench.sim import Condition
from workbench.timeseries import TimeSeries

__all__ = ["EVENTS", "LEAST_HOPS", "EventTest", "compare_events", "hop_events", "twins"]

EVENTS = ("period_s", "apex_m", "contact_s", "stride_m")
"""Of each hop: time to the next, greatest height, time on the ground, forward travel."""
LEAST_HOPS = 5

_UP_M, _DOWN_M = 2e-3, 1e-3  # a hop begins above the first, after the foot was below the second
_SMOOTHED = 3  # samples of a running median
_TWINS = 4
_START_RAD = 2e-3  # between the twins
_FILMING = 1  # tells the noise of the cameras from the draws of the starts


@dataclass(frozen=True)
class EventTest:
    """One property of the hops, measured and simulated.

    Args:
        name: of `EVENTS`.
        measured: mean over the hops, in the unit of the name.
        error: standard error of that mean and the simulated one together.
        simulated: mean over the twins' hops.
        p_value: of the two-sample Kolmogorov-Smirnov test; hops that remember each other make it
            too small.
    """

    name: str
    measured: float
    error: float
    simulated: float
    p_value: float

    @property
    def apart(self) -> float:
        """Return simulated less measured, in standard errors."""
        return (self.simulated - self.measured) / self.error if self.error else float("nan")

    def as_json(self) -> dict[str, float]:
        """Return the numbers by name."""
        return {"measured": self.measured, "simulated": self.simulated,
                "standard_error": self.error, "p_value": self.p_value}  # fmt: skip


def hop_events(motion: TimeSeries, start: float, stop: float) -> NDArray[np.float64]:
    """Return the `EVENTS` of each whole hop between two times [s], (hops, 4).

    Args:
        motion: the foot's channels, its rest at the origin; samples not seen are bridged.
        start: [s].
        stop: [s].
    """
    part = motion.between(start, stop)
    path = position(part, FOOT)[:, [0, 2]]
    seen = np.isfinite(path).all(axis=1)
    if np.count_nonzero(seen) < _SMOOTHED:
        return np.empty((0, len(EVENTS)))
    times = part.times
    filled = [np.interp(times, times[seen], column[seen]) for column in path.T]
    windows = np.lib.stride_tricks.sliding_window_view(np.array(filled), _SMOOTHED, axis=1)
    x, z = np.median(windows, axis=-1)
    times = times[_SMOOTHED // 2 : _SMOOTHED // 2 + len(z)]
    begins = _take_offs(z)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    hops = [
        (times[b] - times[a], z[a:b].max(), step * np.count_nonzero(z[a:b] < _UP_M), x[b] - x[a])
        for a, b in pairwise(begins)
    ]
    return np.array(hops).reshape(-1, len(EVENTS))


def twins(condition: Condition, seed: int = 0) -> list[Condition]:
    """Return a condition with starts a little apart: what chaos makes of it spreads their hops."""
    angles = np.random.default_rng(seed).normal(condition.start_angle, _START_RAD, _TWINS)
    return [replace(condition, start_angle=float(angle)) for angle in angles]


def compare_events(
    run: MeasuredRun, simulated: Sequence[TimeSeries], start: float, seed: int = 0
) -> tuple[EventTest, ...]:
    """Compare the hops of a run, from `start` [s] on, with those of its twins.

    Args:
        run: measured.
        simulated: motions of twins with starts a little apart, on the run's clock.
        start: from where on.
        seed: of the cameras' noise that the twins get.

    Returns:
        One test for each of `EVENTS`; none where either shows fewer than five hops.
    """
    stop = float(run.motion.times[-1])
    measured = hop_events(_from_rest(run), start, stop)
    rng = np.random.default_rng([seed, _FILMING])
    told = [hop_events(_filmed(motion, run.noise(), rng), start, stop) for motion in simulated]
    every = np.concatenate([np.empty((0, len(EVENTS))), *told])
    if min(len(measured), len(every)) < LEAST_HOPS:
        return ()
    return tuple(_test(k, measured, every) for k in range(len(EVENTS)))


def _test(k: int, measured: NDArray[np.float64], simulated: NDArray[np.float64]) -> EventTest:
    m, s = measured[:, k], simulated[:, k]
    error = float(np.hypot(m.std(ddof=1) / np.sqrt(len(m)), s.std(ddof=1) / np.sqrt(len(s))))
    p_value = float(np.asarray(scipy.stats.ks_2samp(m, s)[1]))
    return EventTest(EVENTS[k], float(m.mean()), error, float(s.mean()), p_value)


def _take_offs(z: NDArray[np.float64]) -> list[int]:
    """Return the samples at which the foot rises, each after it was down."""
    begins, down = [], False
    for k, height in enumerate(z):
        if height < _DOWN_M:
            down = True
        elif height > _UP_M and down:
            begins.append(k)
            down = False
    return begins


def _from_rest(run: MeasuredRun) -> TimeSeries:
    rest = dict(zip(run.places, run.at_rest(), strict=True))
    origin = np.array([np.nan_to_num(rest.get(name, 0.0)) for name in run.motion.names])
    motion = run.motion
    return TimeSeries(motion.times, motion.values - origin, motion.names, motion.valid)


def _filmed(motion: TimeSeries, noise: NDArray[np.float64], rng: np.random.Generator) -> TimeSeries:
    """Return the foot's motion with the cameras' noise, (c,), first in x and z."""
    foot = motion.select(FOOT)
    deviation = np.array([noise[0], 0.0, noise[1]])
    values = foot.values + deviation * rng.standard_normal(foot.values.shape)
    return TimeSeries(foot.times, values, foot.names, foot.valid)
