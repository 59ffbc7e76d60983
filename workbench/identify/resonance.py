"""Resonances from data: peaks of the answer over the rotor's speed, and jumps between its branches.

Two things are separated. A resonance is steep, but w^2 over its answer is a smooth curve of w^2:
for one oscillator a straight line. A jump between two possible motions is smooth in neither.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.identify.oscillator import fit_oscillator
from workbench.identify.spectrum import Oscillation, Spectrum, oscillation, spectrum
from workbench.identify.sweep import Direction, SweepPoint, read_sweep
from workbench.motion import ORDERS

__all__ = ["Jump", "Peak", "Resonances", "find_jumps", "find_peaks", "resonances"]

JumpKind = Literal["along the sweep", "up against down", "period doubled"]

_SIGMAS = 3.0
_PEAK_SIGMAS = 2.0  # a peak's own error is large where it still grows
_MOST_MISS = 0.5  # of an answer beside a peak: beyond, it is no oscillator
_LEAST_JUMP = 0.5  # of the greater amplitude: what no smooth course explains
_LEAST_SPLIT = 0.2  # of the greater amplitude, between up and down
_ALIKE = 0.01  # share of a speed within which up and down are compared
_DOUBLED = 0.25  # half-order over first-order amplitude


@dataclass(frozen=True)
class Peak:
    """A resonance of the driven robot.

    Args:
        direction: of the sweep.
        oscillation: its name by the direction of T's motion.
        speed: of the rotor [rad/s].
        speed_error: standard error of it [rad/s].
        amplitude: of T along x and z at the highest point measured [m].
        damping_ratio: of the fitted oscillator, None where none fits.
        fitted: whether an oscillator was fitted; else the highest point and its neighbours count.
    """

    direction: Direction
    oscillation: Oscillation
    speed: float
    speed_error: float
    amplitude: tuple[float, float]
    damping_ratio: float | None
    fitted: bool

    @property
    def hz(self) -> float:
        """Return the frequency of the peak."""
        return self.speed / (2 * np.pi)


@dataclass(frozen=True)
class Jump:
    """Where the answer leaves its branch.

    Args:
        kind: how it shows.
        direction: of the sweep in which it shows; of the first of two where both are compared.
        speeds: between which it lies, the lower first [rad/s].
        amplitudes: of T, both axes together, on both sides or both branches [m].
    """

    kind: JumpKind
    direction: Direction
    speeds: tuple[float, float]
    amplitudes: tuple[float, float]

    def __str__(self) -> str:
        """Say in a sentence what happens."""
        low, high = self.speeds
        one, other = (1000 * a for a in self.amplitudes)
        if self.kind == "along the sweep":
            return (
                f"sweep {self.direction}: T's amplitude goes from {one:.1f} to {other:.1f} mm "
                f"between {low:.2f} and {high:.2f} rad/s, more than a resonance explains"
            )
        if self.kind == "up against down":
            return (
                f"at {low:.2f} rad/s T swings by {one:.1f} mm with rising and {other:.1f} mm with "
                "falling speed: two motions are possible"
            )
        return (
            f"sweep {self.direction}, {low:.2f} rad/s: T swings by {other:.1f} mm at half the "
            f"rotor's speed and {one:.1f} mm at the whole: the period is doubled"
        )


@dataclass(frozen=True, eq=False)
class Resonances:
    """What runs show of resonances.

    Args:
        points: T's answer to each speed, in the order of time; empty without clamped runs.
        peaks: of the answer.
        jumps: of the answer.
        spectra: of every run.
        warnings: as whole sentences.
    """

    points: tuple[SweepPoint, ...]
    peaks: tuple[Peak, ...]
    jumps: tuple[Jump, ...]
    spectra: tuple[Spectrum, ...]
    warnings: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return everything as the command line prints it, SI with units in the names."""
        return {
            "points": [_point_json(point) for point in self.points],
            "peaks": [asdict(peak) | {"hz": peak.hz} for peak in self.peaks],
            "jumps": [asdict(jump) | {"text": str(jump)} for jump in self.jumps],
            "lines": {
                s.run: [asdict(line) | {"name": line.name} for line in s.lines]
                for s in self.spectra
            },
            "warnings": list(self.warnings),
        }


def resonances(runs: Sequence[MeasuredRun]) -> Resonances:
    """Return spectra, answer over the speed, peaks and jumps of runs in the order of time.

    Raises:
        InputError: when no run can be looked at.
    """
    warnings: list[str] = []
    spectra: list[Spectrum] = []
    for run in runs:
        try:
            spectra.append(spectrum(run))
        except InputError as error:
            warnings.append(str(error))
    points: tuple[SweepPoint, ...] = ()
    if any(run.mode == "clamped" for run in runs):
        points, omitted = read_sweep(runs)
        warnings += omitted
    if not (spectra or points):
        raise InputError("no run can be looked at: " + "; ".join(warnings or ["none is given"]))
    warnings += [
        f"{p.run}: at {p.speed:.2f} rad/s the answer still changes by {100 * p.change:+.0f} %; "
        "hold the speed longer"
        for p in points
        if not p.steady
    ]
    return Resonances(
        points,
        tuple(find_peaks(points)),
        tuple(find_jumps(points)),
        tuple(spectra),
        tuple(warnings),
    )


def find_peaks(points: Sequence[SweepPoint]) -> Iterator[Peak]:
    """Yield the peaks of the answer at the rotor's speed, both axes together.

    An oscillator is fitted to the highest point and its neighbours, amplitude and phase at once.
    Where it does not fit between them, or a branch ends beside it, the peak is the highest point
    and its error that of a place anywhere between the neighbours.
    """
    for leg in _by_direction(points):
        for k in range(1, len(leg) - 1):
            if _is_peak(leg, k):
                yield _peak(leg, k)


def find_jumps(points: Sequence[SweepPoint]) -> Iterator[Jump]:
    """Yield where the answer jumps along a sweep, between sweeps, or to half the rotor's speed."""
    legs = list(_by_direction(points))
    for leg in legs:
        if leg[0].direction == "unordered":
            continue  # no sweep: each run began from rest, and no branch was followed
        for k in range(len(leg) - 1):
            if _jumps(leg, k):
                yield Jump("along the sweep", leg[k].direction, (leg[k].speed, leg[k + 1].speed),
                           (_size(leg[k]), _size(leg[k + 1])))  # fmt: skip
    for k, leg in enumerate(legs):
        for other in legs[k + 1 :]:
            yield from _splits(leg, other)
    for point in points:
        if _is_doubled(point):
            yield Jump("period doubled", point.direction, (point.speed, point.speed),
                       (_size(point), _size(point, 0.5)))  # fmt: skip


def _is_peak(leg: Sequence[SweepPoint], k: int) -> bool:
    """Return whether the answer falls on both sides of a point, by more than errors.

    That is the prominence of a peak, as scipy.signal.peak_prominences has it.
    """
    size = np.array([_size(point) for point in leg])
    if size[k] < max(size[k - 1], size[k + 1]):
        return False
    feet = []
    for side in (range(k - 1, -1, -1), range(k + 1, len(leg))):
        until = next((i for i in side if size[i] > size[k]), None)
        lower = [i for i in side if until is None or abs(i - k) < abs(until - k)]
        feet.append(min(lower, key=lambda i: size[i]))
    foot = max(feet, key=lambda i: size[i])
    unsure = np.hypot(*(np.hypot(*leg[i].amplitude_error()) for i in (k, foot)))
    return bool(size[k] - size[foot] > _PEAK_SIGMAS * unsure)


def _peak(leg: Sequence[SweepPoint], k: int) -> Peak:
    near = leg[max(k - 2, 0) : k + 3] if len(leg) >= 5 else leg[k - 1 : k + 2]
    low, high = leg[k - 1].speed, leg[k + 1].speed
    x, z = (float(a) for a in leg[k].amplitude())
    broken = _jumps(leg, k - 1) or _jumps(leg, k)  # the branch ends here: no oscillator does that
    for chosen in () if broken else (near, leg[k - 1 : k + 2]):
        found = fit_oscillator(
            np.array([p.speed for p in chosen]),
            np.array([p.answer[:, ORDERS.index(1.0)] for p in chosen]),
            np.array([p.error[:, ORDERS.index(1.0)] for p in chosen]),
        )
        if found is None or found.miss > _MOST_MISS or found.speed_error > (high - low) / 4:
            continue
        if low < found.speed < high:
            return Peak(leg[k].direction, oscillation(x, z), found.speed, found.speed_error,
                        (x, z), found.damping_ratio, True)  # fmt: skip
    sigma = (high - low) / np.sqrt(12)
    return Peak(leg[k].direction, oscillation(x, z), leg[k].speed, sigma, (x, z), None, False)


def _jumps(leg: Sequence[SweepPoint], k: int) -> bool:
    """Return whether no smooth course from either side leads from point k to the next."""
    axis = int(np.argmax(leg[k].amplitude() + leg[k + 1].amplitude()))
    expected = [
        (leg[a], leg[b], leg[c])
        for a, b, c in ((k - 1, k, k + 1), (k + 2, k + 1, k))
        if 0 <= a < len(leg)
    ]
    return bool(expected) and all(
        _surprises(before, here, there, axis, inverse)
        for before, here, there in expected
        for inverse in (False, True)
    )


def _surprises(
    before: SweepPoint, here: SweepPoint, there: SweepPoint, axis: int, inverse: bool
) -> bool:
    """Return whether `there` is far from the straight line through the two points before it.

    Inverse lines are those of w^2 / answer over w^2, as a resonance has them; else of the answer.
    """
    first = ORDERS.index(1.0)
    w = np.array([p.speed for p in (before, here, there)]) ** 2
    a = np.array([p.answer[axis, first] for p in (before, here, there)])
    e = np.array([p.error[axis, first] for p in (before, here, there)])
    ahead = (w[2] - w[1]) / (w[1] - w[0])
    if inverse:
        line = w[1] / a[1] + ahead * (w[1] / a[1] - w[0] / a[0])
        predicted = w[2] / line
        carry = (
            np.abs(predicted**2 / w[2]) * np.array([ahead, 1 + ahead]) * w[:2] / np.abs(a[:2]) ** 2
        )
    else:
        predicted = a[1] + ahead * (a[1] - a[0])
        carry = np.array([ahead, 1 + ahead])
    unsure = np.sqrt(e[2] ** 2 + np.sum((carry * e[:2]) ** 2))
    apart, size = abs(a[2] - predicted), max(abs(a[2]), abs(predicted))
    return bool(apart > _SIGMAS * unsure and apart > _LEAST_JUMP * size)


def _splits(leg: Sequence[SweepPoint], other: Sequence[SweepPoint]) -> Iterator[Jump]:
    """Yield where two sweeps answer the same speed differently."""
    for point in leg:
        twin = min(other, key=lambda p: abs(p.speed - point.speed))
        if abs(twin.speed / point.speed - 1) > _ALIKE:
            continue
        apart = np.abs(point.amplitude() - twin.amplitude())
        axis = int(np.argmax(apart))
        unsure = np.hypot(point.amplitude_error()[axis], twin.amplitude_error()[axis])
        moved = _slope(leg, point, axis) * abs(twin.speed - point.speed)
        greater = max(point.amplitude()[axis], twin.amplitude()[axis])
        if apart[axis] > moved + max(_SIGMAS * unsure, _LEAST_SPLIT * greater):
            yield Jump("up against down", point.direction, (point.speed, point.speed),
                       (_size(point), _size(twin)))  # fmt: skip


def _slope(leg: Sequence[SweepPoint], point: SweepPoint, axis: int) -> float:
    """Return the greatest slope of the amplitude beside a point [m s/rad]."""
    k = next(i for i, p in enumerate(leg) if p is point)
    beside = [leg[i] for i in (k - 1, k + 1) if 0 <= i < len(leg)]
    return max(
        (
            abs((p.amplitude()[axis] - point.amplitude()[axis]) / (p.speed - point.speed))
            for p in beside
            if p.speed != point.speed
        ),
        default=0.0,
    )


def _is_doubled(point: SweepPoint) -> bool:
    """Return whether T keeps swinging at half the rotor's speed; a free vibration would fade."""
    at = ORDERS.index(0.5)
    half = point.amplitude(0.5)
    axis = int(np.argmax(half))
    fades = point.changes[axis, at] < 0 and not point.steadies[axis, at]
    sure = half[axis] > _SIGMAS * point.error[axis, at]
    return bool(sure and not fades and half[axis] > _DOUBLED * point.amplitude().max())


def _size(point: SweepPoint, order: float = 1.0) -> float:
    return float(np.hypot(*point.amplitude(order)))


def _by_direction(points: Sequence[SweepPoint]) -> Iterator[list[SweepPoint]]:
    """Yield the points of each direction by rising speed, those of one speed as their mean."""
    for direction in dict.fromkeys(point.direction for point in points):
        alike: list[list[SweepPoint]] = []
        for point in sorted((p for p in points if p.direction == direction), key=lambda p: p.speed):
            if alike and point.speed / alike[-1][0].speed - 1 < _ALIKE:
                alike[-1].append(point)
            else:
                alike.append([point])
        yield [_mean(group) for group in alike]


def _mean(group: Sequence[SweepPoint]) -> SweepPoint:
    """Return the weighted mean of repeats; its error knows of their scatter."""
    if len(group) == 1:
        return group[0]
    answers = np.array([point.answer for point in group])
    weights = np.array([point.error for point in group]) ** -2.0
    total = weights.sum(axis=0)
    mean = (weights * answers).sum(axis=0) / total
    misfit = (weights * np.abs(answers - mean) ** 2).sum(axis=0) / (2 * (len(group) - 1))
    error = np.sqrt(np.maximum(misfit, 1.0) / total)
    speed = float(np.mean([point.speed for point in group]))
    return replace(group[0], speed=speed, answer=mean, error=error)


def _point_json(point: SweepPoint) -> dict[str, Any]:
    amplitudes: NDArray[np.float64] = np.abs(point.answer)
    return {
        "run": point.run,
        "direction": point.direction,
        "speed_rad_s": point.speed,
        "speed_error_rad_s": point.speed_error,
        "orders": list(ORDERS),
        "amplitude_x_m": amplitudes[0].tolist(),
        "amplitude_z_m": amplitudes[1].tolist(),
        "error_x_m": point.error[0].tolist(),
        "error_z_m": point.error[1].tolist(),
        "lag_rad": point.lag.tolist(),
        "change": point.change,
        "steady": point.steady,
    }
