"""Damping from ring-downs against amplitude: is it viscous?

Two damped sinusoids are fitted in windows one after the other. A viscous one fades at the same rate
in all of them; friction damps small swings more, the drag of air large ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.identify.spectrum import Oscillation, oscillation
from workbench.motion import LEAST_SAMPLES, TOP, DampedSinusoid, fit_sinusoids, position

__all__ = ["DampingPoint", "ModeDamping", "damping"]

_WINDOW_S = 3.3  # separates the faster mode from twice the slower, 0.4 Hz above it, and noise
_MODES = 2
_DOUBLE_SHARE = 0.05
_LEAST_AMPLITUDE_M = 5e-4  # with markers of 0.3 mm noise smaller ones are too uncertain
_SURE = 0.01  # chance of a trend where there is none, that is still believed to be a trend
_MATTERS = 0.1  # of the mean damping, over the amplitudes seen
_LEAST_POINTS = 4


@dataclass(frozen=True)
class DampingPoint:
    """One damped sinusoid in one window.

    Args:
        run: in which it rang.
        time: middle of the window, after the release [s].
        amplitude: of T along the swing's own direction in that middle [m].
        hz: frequency.
        hz_error: standard error of it.
        ratio: of the critical damping.
        ratio_error: standard error of it.
    """

    run: str
    time: float
    amplitude: float
    hz: float
    hz_error: float
    ratio: float
    ratio_error: float


@dataclass(frozen=True)
class ModeDamping:
    """The damping of one mode over all windows of all runs.

    Args:
        oscillation: its name by the direction of T's motion.
        points: in the order of runs and time.
        hz: weighted mean frequency.
        ratio: weighted mean ratio of the critical damping.
        interval90: of that mean.
        trend: change of the ratio from the smallest to the greatest amplitude seen.
        p_value: chance of a trend so strong where there is none; NaN with fewer than 4 points.
    """

    oscillation: Oscillation
    points: tuple[DampingPoint, ...]
    hz: float
    ratio: float
    interval90: tuple[float, float]
    trend: float
    p_value: float

    @property
    def viscous(self) -> bool | None:
        """Return whether the damping is the same at all amplitudes; None where few are seen."""
        if not np.isfinite(self.p_value):
            return None
        return not (self.p_value < _SURE and abs(self.trend) > _MATTERS * self.ratio)

    @property
    def amplitudes(self) -> tuple[float, float]:
        """Return the smallest and the greatest amplitude seen [m]."""
        seen = [point.amplitude for point in self.points]
        return min(seen), max(seen)

    def __str__(self) -> str:
        """Say in a sentence what the damping is."""
        low, high = (1000 * a for a in self.amplitudes)
        low_ratio, high_ratio = (100 * r for r in self.interval90)
        text = (
            f"{self.oscillation}, {self.hz:.3f} Hz: {100 * self.ratio:.2f} % of the critical "
            f"damping ({low_ratio:.2f} to {high_ratio:.2f}) at {low:.1f} to {high:.1f} mm"
        )
        match self.viscous:
            case None:
                return f"{text}; too few windows to say whether it is viscous"
            case True:
                return f"{text}, viscous: no trend with the amplitude"
            case False if self.trend < 0:
                return f"{text}, not viscous: it falls with the amplitude, as friction does"
            case False:
                return f"{text}, not viscous: it rises with the amplitude, as the drag of air does"

    def as_json(self) -> dict[str, Any]:
        """Return everything as the command line prints it."""
        return asdict(self) | {"viscous": self.viscous}


def damping(runs: Sequence[MeasuredRun]) -> tuple[ModeDamping, ...]:
    """Return frequency and damping against amplitude of each mode that rings in decay runs.

    Args:
        runs: those of other modes than decay are left out.

    Raises:
        InputError: when no decay run is among them, or none rings.
    """
    ringing = [run for run in runs if run.mode == "decay"]
    if not ringing:
        raise InputError(
            "no ring-down is given; damping needs runs of mode decay, for example of "
            "protocols/free-decay.yaml"
        )
    found: dict[Oscillation, list[DampingPoint]] = {"torsional": [], "longitudinal": []}
    for run in ringing:
        for name, point in _windows(run):
            found[name].append(point)
    modes = tuple(_mode(name, points) for name, points in found.items() if points)
    if not modes:
        raise InputError(
            f"T swings by less than {1000 * _LEAST_AMPLITUDE_M:g} mm after the releases of "
            + ", ".join(run.name for run in ringing)
            + "; pull harder"
        )
    return modes


def _windows(run: MeasuredRun) -> Iterator[tuple[Oscillation, DampingPoint]]:
    """Yield each sinusoid of each window, as long as it is large enough to be determined."""
    swinging = run.motion.between(0.0, np.inf)
    times, path = swinging.times, position(swinging, TOP)[:, [0, 2]]
    if not _enough(path):
        return
    sinusoids = fit_sinusoids(times, path, _MODES).sinusoids
    parts = max(1, round((times[-1] - times[0]) / _WINDOW_S))
    edges = np.linspace(times[0], times[-1], parts + 1)
    for begin, end in pairwise(edges):
        inside = (times >= begin) & (times < end)
        if _enough(path[inside]):
            yield from _sinusoids(run.name, times[inside], path[inside], sinusoids)


def _sinusoids(
    run: str, times: NDArray[np.float64], path: NDArray[np.float64], start: Sequence[DampedSinusoid]
) -> Iterator[tuple[Oscillation, DampingPoint]]:
    slow = start[0]
    double = DampedSinusoid(2 * slow.hz, 2 * slow.decay)  # a bent beam answers there too
    found = fit_sinusoids(times, path, len(start) + 1, start=[*start, double])
    first = times[np.isfinite(path).all(axis=1)][0]
    middle = (times[0] + times[-1]) / 2
    every = zip(found.sinusoids, found.sinusoid_errors, found.amplitudes, strict=True)
    for sinusoid, error, along in every:
        if abs(sinusoid.hz / double.hz - 1) < _DOUBLE_SHARE:
            continue
        size = float(np.linalg.norm(along)) * float(np.exp(-sinusoid.decay * (middle - first)))
        if size >= _LEAST_AMPLITUDE_M:
            omega = 2 * np.pi * sinusoid.hz
            yield oscillation(abs(along[0]), abs(along[1])), DampingPoint(
                run, float(middle), size, sinusoid.hz, error.hz, sinusoid.damping_ratio,
                error.decay / omega,
            )  # fmt: skip


def _mode(name: Oscillation, points: Sequence[DampingPoint]) -> ModeDamping:
    """Return means and trend; errors are widened by the scatter that they do not explain."""
    ratio = np.array([point.ratio for point in points])
    weight = np.array([point.ratio_error for point in points]) ** -2
    mean = float(weight @ ratio / weight.sum())
    hz_weight = np.array([point.hz_error for point in points]) ** -2
    hz = float(hz_weight @ [point.hz for point in points] / hz_weight.sum())
    free = max(len(points) - 1, 1)
    birge = max(1.0, float(weight @ (ratio - mean) ** 2) / free)
    reach = float(scipy.stats.t.ppf(0.95, free)) * float(np.sqrt(birge / weight.sum()))
    trend, p_value = _trend(np.log([point.amplitude for point in points]), ratio, weight)
    return ModeDamping(name, tuple(points), hz, mean, (mean - reach, mean + reach), trend, p_value)


def _trend(
    x: NDArray[np.float64], ratio: NDArray[np.float64], weight: NDArray[np.float64]
) -> tuple[float, float]:
    """Return the change of the ratio over the span of x, and the chance of it without a trend."""
    if len(x) < _LEAST_POINTS or np.ptp(x) == 0:
        return float("nan"), float("nan")
    off = x - weight @ x / weight.sum()
    square = float(weight @ off**2)
    slope = float((weight * off) @ ratio) / square
    mean = float(weight @ ratio / weight.sum())
    free = len(x) - 2
    birge = max(1.0, float(weight @ (ratio - mean - slope * off) ** 2) / free)
    chance = 2 * float(scipy.stats.t.sf(abs(slope) / np.sqrt(birge / square), free))
    return slope * float(np.ptp(x)), chance


def _enough(path: NDArray[np.float64]) -> bool:
    return int(np.count_nonzero(np.isfinite(path).all(axis=1))) >= LEAST_SAMPLES
