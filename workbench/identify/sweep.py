"""T's answer to each rotor speed of a sweep: amplitude and phase against the rotor, with errors.

The rotor pulls T with m r w^2 along its own direction; what T answers is fitted by
`workbench.motion.clamped`, so that a run of ten seconds shows the answer and not the ringing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.motion import (
    LEAST_SAMPLES,
    ORDERS,
    ROTOR_ANGLE,
    TOP,
    SinusoidFit,
    answer,
    factors,
    fit_sinusoids,
    lag,
    steady_end,
    terms,
)
from workbench.timeseries import TimeSeries
from workbench.tracking import mean_speed, unwrapped

__all__ = ["Direction", "Plateau", "SweepPoint", "SweepResult", "plateaus", "read_sweep"]

Direction = Literal["up", "down", "unordered"]
"""Whether the speeds rose or fell in the order of time; unordered where they did neither."""

_LEAST_HOLD_S = 3.0
_SEEN_SHARE = 0.6
_STEADY_SHARE = 0.05  # of the amplitude, from one half of the window to the other
_LEAST_LEG = 3  # speeds in a row, on the mean, that make a direction
_ALIKE = 0.01  # share of the speed within which two commands are one


class Plateau(NamedTuple):
    """A part of a run in which one speed was commanded [s], [s], [rad/s]."""

    start: float
    stop: float
    speed: float


@dataclass(frozen=True, eq=False)
class SweepPoint:
    """T's steady answer to one speed: place = mean + Re(sum over ORDERS of a exp(i order angle)).

    Args:
        run: in which it was measured.
        start: of the part that was looked at, in the run's time [s].
        stop: its end [s].
        direction: of the sweep at this point.
        speed: of the rotor in the world, always positive [rad/s].
        speed_error: standard error of it.
        answer: (2, orders) complex, of T along x and z [m].
        error: (2, orders) standard error of each answer's real and imaginary part [m]; one that is
            not steady is unsure by its change.
        changes: (2, orders) of each amplitude, last half over first half, less one [1].
        steadies: (2, orders) whether that change is within 5 % and one of its errors.
    """

    run: str
    start: float
    stop: float
    direction: Direction
    speed: float
    speed_error: float
    answer: NDArray[np.complex128]
    error: NDArray[np.float64]
    changes: NDArray[np.float64]
    steadies: NDArray[np.bool_]

    @property
    def change(self) -> float:
        """Return the change of the greatest amplitude."""
        return float(self.changes.flat[np.abs(self.answer).argmax()])

    @property
    def steady(self) -> bool:
        """Return whether the greatest amplitude is steady."""
        return bool(self.steadies.flat[np.abs(self.answer).argmax()])

    def amplitude(self, order: float = 1.0) -> NDArray[np.float64]:
        """Return the amplitudes of T along x and z, (2,) [m]."""
        return np.abs(self.answer[:, ORDERS.index(order)])

    def amplitude_error(self, order: float = 1.0) -> NDArray[np.float64]:
        """Return their standard errors, (2,) [m]."""
        return self.error[:, ORDERS.index(order)]

    @property
    def lag(self) -> NDArray[np.float64]:
        """Return by how much T follows the rotor's pull, along x and z, (2,) [rad] in -pi to pi.

        Near zero far below a resonance, pi/2 on it, near pi far above it.
        """
        return lag(self.answer)


class SweepResult(NamedTuple):
    """Result of a sweep: its points in the order of time, and what could not be used and why."""

    points: tuple[SweepPoint, ...]
    warnings: tuple[str, ...]


def read_sweep(runs: Sequence[MeasuredRun]) -> SweepResult:
    """Return T's answer at every plateau of clamped runs.

    A run of one speed from rest gives one point, a staircase one for each step.

    Args:
        runs: in the order in which they were measured; those that are not clamped are left out.

    Raises:
        InputError: when no clamped run is among them.
    """
    clamped = [run for run in runs if run.mode == "clamped"]
    if not clamped:
        raise InputError(
            "no clamped run is given; amplitude and phase over the speed need a sweep with the "
            "foot clamped, for example of protocols/clamped-sweep.yaml"
        )
    points: list[SweepPoint] = []
    warnings: list[str] = []
    for run in clamped:
        angle = unwrapped(run.motion.times, _seen(run.motion, ROTOR_ANGLE)).angle
        held = list(plateaus(run))
        if not held:
            warnings.append(f"{run.name}: holds no speed for {_LEAST_HOLD_S:g} s")
        for plateau in held:
            try:
                points.append(_point(run, plateau, angle))
            except InputError as error:
                warnings.append(f"{run.name} at {plateau.speed:.2f} rad/s: {error}")
    return SweepResult(tuple(_directed(points)), tuple(warnings))


def plateaus(run: MeasuredRun) -> Iterator[Plateau]:
    """Yield the parts of a run in which one speed was held for 3 s or longer."""
    begins = [t for t, _ in run.steps]
    ends = [*begins[1:], float(run.motion.times[-1])]
    for (begin, speed), end in zip(run.steps, ends, strict=True):
        if speed != 0 and end - begin >= _LEAST_HOLD_S:
            yield Plateau(begin, min(end, float(run.motion.times[-1])), speed)


def _point(run: MeasuredRun, plateau: Plateau, angle: NDArray[np.float64]) -> SweepPoint:
    """Return the answer in the steady end of a plateau.

    Raises:
        InputError: when T or the rotor are seen too little there.
    """
    start = steady_end(plateau.start, plateau.stop)
    inside = (run.motion.times >= start) & (run.motion.times <= plateau.stop)
    times, phi = run.motion.times[inside], angle[inside]
    top = np.column_stack([_seen(run.motion, TOP[axis])[inside] for axis in (0, 2)])
    seen = np.isfinite(top).all(axis=1) & np.isfinite(phi)
    if np.count_nonzero(seen) < max(LEAST_SAMPLES, _SEEN_SHARE * len(times)):
        raise InputError(
            f"T and rotor are seen in only {100 * np.mean(seen):.0f} % of its steady end; "
            "did the robot fall, or hide its markers?"
        )
    speed = mean_speed(times, phi)
    found = answer(times, top, phi, abs(speed.value))
    response, error = factors(found)
    changes, steadies = _changes(times, top, phi, found)
    error = np.where(steadies, error, np.hypot(error, changes * np.abs(response)))
    return SweepPoint(
        run.name, start, plateau.stop, "unordered", abs(speed.value), speed.standard_error,
        response, error, changes, steadies,
    )  # fmt: skip


def _changes(
    times: NDArray[np.float64],
    top: NDArray[np.float64],
    phi: NDArray[np.float64],
    found: SinusoidFit,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return how the amplitudes changed from half to half, and which are steady, (2, orders)."""
    columns = np.insert(terms(phi), 0, 1.0, axis=1)
    driven = columns @ found.beside + found.residual  # without the robot's free vibration
    middle = (times[0] + times[-1]) / 2
    (first, first_error), (last, last_error) = (
        factors(fit_sinusoids(times[half], driven[half], 0, beside=terms(phi[half])))
        for half in (times <= middle, times > middle)
    )
    size = np.maximum(np.abs(first), np.finfo(float).tiny)
    changes = np.abs(last) / size - 1
    unsure = np.hypot(first_error, last_error) / size
    return changes, np.abs(changes) <= _STEADY_SHARE + unsure


def _directed(points: Sequence[SweepPoint]) -> Iterator[SweepPoint]:
    """Yield the points with the direction in which their speeds were gone through."""
    for leg, direction in _legs([point.speed for point in points]):
        for k in leg:
            yield replace(points[k], direction=direction)


def _legs(speeds: Sequence[float]) -> list[tuple[range, Direction]]:
    """Return the stretches of rising and of falling speeds; one unordered stretch if they jumble.

    A speed that is measured again at a turn begins the new stretch; one that is measured again on
    the way belongs to it.
    """
    if not speeds:
        return []
    legs: list[tuple[range, Direction]] = []
    begin, sign = 0, 0.0
    for k in range(1, len(speeds)):
        step = 0.0 if abs(speeds[k] / speeds[k - 1] - 1) < _ALIKE else speeds[k] - speeds[k - 1]
        if step * sign < 0:
            again = abs(speeds[k - 1] / speeds[k - 2] - 1) < _ALIKE
            turn = k - 1 if again else k
            legs.append((range(begin, turn), "up" if sign > 0 else "down"))
            begin, sign = turn, step
        elif step:
            sign = step
    legs.append((range(begin, len(speeds)), "up" if sign > 0 else "down"))
    if sign == 0 or len(legs) > max(2.0, len(speeds) / _LEAST_LEG):
        return [(range(len(speeds)), "unordered")]
    return legs


def _seen(motion: TimeSeries, name: str) -> NDArray[np.float64]:
    return np.where(motion.validity(name), motion[name], np.nan)
