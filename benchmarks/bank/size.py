"""The size of an effect: what is left of it when all that a base fit may change was refitted.

    size = RMS over T and rotor of (e - X b) / 0.3 mm,

e the change that the effect makes, X b what base parameters, the instant, speed and start angle of
each run and an offset for each place make of it, b their least-squares amounts. Parameters of the
model pay for their amount by their tolerance and stay within it. The refit simulates what it moves,
for a hop does not answer in proportion; its derivatives, the generator's own differences at first,
learn from every trial (Broyden 1965, doi:10.1090/S0025-5718-1965-0198670-6).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import lsq_linear

from benchmarks.bank.courses import RATE_HZ, Course, Generator, Job, Quantities
from benchmarks.bank.observe import NOISE_M
from workbench.motion import FOOT, ROTOR, TOP
from workbench.timeseries import TimeSeries

__all__ = ["BASE", "FLOOR", "STATED", "Sizing", "UnreachableError", "rms"]

Array = NDArray[np.float64]

BASE = ("hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping", "beam_mass",
        "top_mass", "rotor_mass")  # fmt: skip
"""Parameters that a base fit may change, each within its tolerance."""

STATED = ("rotor_radius",)
"""The same, of robots that all have what the model states."""

FLOOR = ("foot_mass", "ground_stiffness", "ground_damping", "friction_slide", "friction_stick")
"""The same, where the foot is not clamped."""

_STEP = 0.02  # of a tolerance
_GAIN, _ANGLE_RAD, _PULL, _INSTANT_S = 1e-4, 1e-3, 1e-3, 1e-4
_CLOSE = 0.1  # a share by which a size may miss its target
_LINEAR = 5.0  # noise deviations that T and rotor may move by where a refit begins
_REFITS = 15
_SHORTER, _SHORTEST = 0.3, 0.02  # of a step, where it does not pay
_PAYS = 0.02  # of what is left: a whole step that gains less is the last
_TRIALS = 10
_RENEWALS = 4  # of derivatives, where a foot is free
_MOST_GROWTH = 10.0  # of one trial


class UnreachableError(ValueError):
    """A robot on which a case cannot be made: its causes are too weak there, or it falls."""


@dataclass(frozen=True, eq=False)
class Sizing:
    """What is needed to size effects on one robot and some courses.

    Args:
        generator: of the motions.
        values: of the robot, SI.
        tolerances: of the base.
        courses: the runs, cut to what is looked at.
        motions: without the effect.
        base: (r,) motions without the effect, in noise deviations.
        columns: (r, c) changes by all that a base fit may change, then a row for each prior.
    """

    generator: Generator
    values: Mapping[str, float]
    tolerances: Mapping[str, float]
    courses: tuple[Course, ...]
    motions: tuple[TimeSeries, ...]
    base: Array
    columns: Array

    @property
    def priors(self) -> int:
        """Return how many numbers of the base pay for their amounts."""
        return len(self.tolerances)

    @classmethod
    def of(
        cls,
        generator: Generator,
        values: Mapping[str, float],
        tolerances: Mapping[str, float],
        courses: Sequence[Course],
    ) -> Sizing:
        """Compute base and columns.

        Raises:
            ValueError: when the robot cannot do what is asked.
        """
        motions = generator.motions([Job(values, {}, course) for course in courses])
        base = _stacked(motions, motions)
        names = BASE + STATED + (FLOOR if _free(courses) else ())
        others = [_with(values, name, _STEP * tolerances[name]) for name in names]
        jobs = [Job(other, {}, course) for other in others for course in courses]
        done, count = generator.motions(jobs), len(courses)
        columns = [
            (_stacked(done[count * i : count * (i + 1)], motions) - base) / _STEP
            for i in range(len(names))
        ]
        begin = 0
        for course, motion in zip(courses, motions, strict=True):
            here = _stacked([motion], [motion])
            moved = [Job(values, {}, one.by(course, one.step)) for one in _own(course)]
            changes = [
                (_stacked([other], [motion]) - here) / one.step
                for other, one in zip(generator.motions(moved), _own(course), strict=True)
            ]
            for change in [*changes, *_observed(motion)]:
                column = np.zeros(len(base))
                column[begin : begin + len(here)] = change
                columns.append(column)
            begin += len(here)
        priors = np.eye(len(names), len(columns))
        whole = np.vstack([np.column_stack(columns), priors])
        paid = {name: tolerances[name] for name in names}
        return cls(generator, values, paid, tuple(courses), tuple(motions), base, whole)

    def change(self, effects: Quantities) -> Array:
        """Return what effects change, (r,) in noise deviations."""
        jobs = [Job(self.values, effects, course) for course in self.courses]
        return _stacked(self.generator.motions(jobs), self.motions) - self.base

    def left(self, change: Array, also: Sequence[Array] = ()) -> Array:
        """Return what is left of a change when the base was refitted, (r,).

        Args:
            change: (r,).
            also: (r,) each, other changes that may come in any amounts.
        """
        columns, priors = self.columns, self.priors
        if also:
            more = [np.append(other, np.zeros(priors)) for other in also]
            columns = np.column_stack([columns, *more])
        amounts = _least(columns, np.append(change, np.zeros(priors)))
        return change - (columns @ amounts)[: len(change)]

    def share(self, one: Array, others: Sequence[Array]) -> float:
        """Return how much of what is left of one change others together cannot imitate."""
        return rms(self.left(one, others)) / rms(self.left(one))

    def scale(
        self, name: str, grow: Callable[[float], dict[str, float]], target: float, most: float
    ) -> tuple[dict[str, float], float]:
        """Return an effect of about the size that is asked for, and its size.

        Args:
            name: of the effect.
            grow: from a factor, 1 for a size of about 1, to its quantities.
            target: size, within 10 %; within 30 % after several trials.
            most: greatest factor.

        Raises:
            UnreachableError: when it stays off within what is physical.
        """
        factor, size, values = min(target, most), 0.0, grow(min(target, most))
        less, more = 0.0, np.inf
        for _ in range(_TRIALS):
            values = grow(factor)
            size = self._size(name, grow, factor)
            if abs(size / target - 1) < 3 * _CLOSE and _free(self.courses):
                size = self._size(name, grow, factor, _RENEWALS)
            if abs(size / target - 1) < _CLOSE or (size < target and factor >= most):
                break
            less, more = (factor, more) if size < target else (less, factor)
            growth = target / max(size, 1e-12)
            factor = min(most, factor * min(max(growth, 1 / _MOST_GROWTH), _MOST_GROWTH))
            if not less < factor < more:  # what sticks or plays does not grow in proportion
                factor = float(np.sqrt(less * more))
        if abs(size / target - 1) < 3 * _CLOSE:
            return values, size
        raise UnreachableError(f"{name} has size {size:.3g} at {values}; {target:g} is asked")

    def _size(
        self, name: str, grow: Callable[[float], dict[str, float]], factor: float, renewals: int = 0
    ) -> float:
        """Return a size; a refit of a large change begins where a small one points to."""
        change = self.change({name: grow(factor)})
        part = min(_LINEAR / max(rms(change), 1e-12), 1.0)
        small = change if part == 1 else self.change({name: grow(part * factor)})
        amounts = _least(self.columns, np.append(small, np.zeros(self.priors))) / part
        return self.refitted(change, np.clip(amounts, -self._reach, self._reach), renewals)

    def refitted(self, change: Array, start: Array, renewals: int = 0) -> float:
        """Return the root mean square of what a refit of the base leaves of a change.

        Args:
            change: (r,).
            start: (c,) amounts to begin with, those of the base within their tolerances.
            renewals: how often derivatives are taken anew where the refit ended, and it goes on.
        """
        wanted = np.append(change, np.zeros(self.priors))
        here, left = self._descended(wanted, self.columns, np.zeros(len(start)), start)
        for _ in range(renewals):
            columns = self._columns_at(here)
            if columns is None:
                break
            step = _least(columns, left)
            before = rms(left)
            there = np.clip(here + step, -self._reach, self._reach)
            here, left = self._descended(wanted, columns, here, there)
            if rms(left) > (1 - _PAYS) * before:
                break
        return rms(left[: len(change)])

    def _descended(
        self, wanted: Array, columns: Array, here: Array, trial: Array
    ) -> tuple[Array, Array]:
        """Return the amounts (c,) that a refit ends at, and what is left there (r + priors,).

        Args:
            wanted: (r + priors,) to be imitated.
            columns: (r + priors, c) derivatives at the place to begin from.
            here: (c,) that place.
            trial: (c,) the first place to be tried.
        """
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        columns, reach = columns / scale, self._reach * scale
        shown = self._shown(here) if np.any(here) else np.zeros(len(wanted))
        here, trial, share = here * scale, trial * scale, 1.0
        for k in range(_REFITS):
            there, move, before = shown, trial - here, rms(wanted - shown)
            with suppress(ValueError):  # such a robot cannot do it
                there = self._shown(trial / scale)
                columns += np.outer(there - shown - columns @ move, move) / (move @ move + 1e-300)
            after = rms(wanted - there)
            if after < before:
                here, shown = trial, there
                if k and share == 1.0 and after > (1 - _PAYS) * before:
                    break
                share = min(1.0, share / _SHORTER)
            else:
                share *= _SHORTER
            if share < _SHORTEST:
                break
            q, r = np.linalg.qr(columns)
            bounds = (-reach - here, reach - here)
            trial = here + share * lsq_linear(r, q.T @ (wanted - shown), bounds).x
        return here / scale, wanted - shown

    def _columns_at(self, amounts: Array) -> Array | None:
        """Return the columns at a place that a refit came to; None where the robot falls there."""
        values, moved, _ = self._placed(amounts)
        there = Sizing.of(self.generator, values, self.tolerances, moved)
        return there.columns if there.columns.shape == self.columns.shape else None

    @property
    def _reach(self) -> Array:
        """Return how far each amount may go, (c,): tolerances for the base."""
        return np.where(np.arange(self.columns.shape[1]) < self.priors, 1.0, np.inf)

    def _shown(self, amounts: Array) -> Array:
        """Return what amounts change, simulated, then what the base pays, (r + priors,)."""
        values, moved, seen = self._placed(amounts)
        parts = []
        done = self.generator.motions([Job(values, {}, course) for course in moved])
        for motion, like, (late, offsets) in zip(done, self.motions, seen, strict=True):
            parts.append((_rows(motion, like, late) + offsets).ravel())
        return np.append(np.concatenate(parts) - self.base, amounts[: self.priors])

    def _placed(
        self, amounts: Array
    ) -> tuple[dict[str, float], list[Course], list[tuple[float, list[float]]]]:
        """Return the robot, the courses, and by course the instant and the offsets of places."""
        base, own = amounts[: self.priors], iter(amounts[self.priors :].tolist())
        values = dict(self.values)
        for (name, tolerance), amount in zip(self.tolerances.items(), base, strict=True):
            values[name] += amount * tolerance
        courses, seen = [], []
        for course, motion in zip(self.courses, self.motions, strict=True):
            moved = course
            for change in _own(course):
                moved = change.by(moved, next(own))
            courses.append(moved)
            seen.append((next(own), [next(own) for _ in range(_places(motion).shape[1])]))
        return values, courses, seen


def rms(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _free(courses: Sequence[Course]) -> bool:
    """Tell whether a foot is free, so that motions do not answer in proportion."""
    return any(course.mode in ("hop", "drop") for course in courses)


def _least(columns: Array, wanted: Array) -> Array:
    """Return the amounts of columns that leave least, (c,)."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return np.linalg.lstsq(columns / scale, wanted, rcond=1e-12)[0] / scale


def _with(values: Mapping[str, float], name: str, more: float) -> dict[str, float]:
    return dict(values) | {name: values[name] + more}


class _Own(NamedTuple):
    """A number of one run: how a course is changed by it, and the step of a difference."""

    by: Callable[[Course, float], Course]
    step: float


def _own(course: Course) -> list[_Own]:
    """Return what a fit may change of one run alone."""
    if course.mode == "decay":
        return [_Own(lambda one, by: one._replace(pull=one.pull * (1 + by)), _PULL)]
    return [_Own(_faster, _GAIN), _Own(_turned, _ANGLE_RAD)]


def _faster(course: Course, share: float) -> Course:
    return course._replace(steps=tuple((t, speed * (1 + share)) for t, speed in course.steps))


def _turned(course: Course, angle: float) -> Course:
    return course._replace(start_angle=course.start_angle + angle)


def _places(motion: TimeSeries) -> Array:
    """Return what is compared, (n, p) in noise deviations: T and rotor, and a foot that moves."""
    names = [TOP[0], TOP[2], ROTOR[0], ROTOR[2]]
    places = motion.select(names).values
    foot = motion.select((FOOT[0], FOOT[2])).values
    moves = np.ptp(foot[:, 1]) > 1e-9
    return (np.hstack([places, foot]) if moves else places) / NOISE_M


def _observed(motion: TimeSeries) -> list[Array]:
    """Return the changes that need no simulation: an instant, and an offset for each place."""
    places = _places(motion)
    late = np.gradient(places, axis=0) * RATE_HZ
    offsets = [np.outer(np.ones(len(places)), row).ravel() for row in np.eye(places.shape[1])]
    return [late.ravel(), *offsets]


def _stacked(motions: Sequence[TimeSeries], like: Sequence[TimeSeries]) -> Array:
    """Return the rows of motions, each as long as the one that it is compared with.

    A motion that ends early, its robot fallen, stays where it is.
    """
    return np.concatenate(
        [_rows(motion, base).ravel() for motion, base in zip(motions, like, strict=True)]
    )


def _rows(motion: TimeSeries, like: TimeSeries, early: float = 0.0) -> Array:
    """Return what is compared of a motion, (n, p), at another's stamps or so much later [s]."""
    at = np.minimum(np.arange(len(like)), len(motion) - 1)
    held = TimeSeries(like.times, motion.values[at], motion.names, motion.valid[at])
    return _places(_shifted(held, motion.times[0] - like.times[0] - early))


def _shifted(motion: TimeSeries, late: float) -> TimeSeries:
    """Return a motion as it looks at stamps that are off."""
    if late == 0.0:
        return motion
    seen = np.maximum(motion.times - late, motion.times[0])  # it rests before
    values = np.asarray(CubicSpline(motion.times, motion.values)(seen))
    return TimeSeries(motion.times, values, motion.names, motion.valid)
