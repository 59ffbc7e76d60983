"""From a drawn case to its runs: the robot, the amounts of its causes, motions, pictures, label."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.bank.amounts import AMOUNTS, OUTSIDE_AMOUNTS, direction, scaled
from benchmarks.bank.cases import Case, Made, Plan, Run, plans
from benchmarks.bank.cases_rod import RodGenerator
from benchmarks.bank.cases_twin import TwinGenerator
from benchmarks.bank.courses import Course, Generator, Job, Quantities
from benchmarks.bank.expected import expected
from benchmarks.bank.observe import FAULTS, Fault, film
from benchmarks.bank.size import BASE, Sizing, UnreachableError
from workbench.schemas import load_model, load_shape
from workbench.timeseries import TimeSeries

__all__ = ["Robot", "further_runs", "generator_of", "make_case", "robot_of", "sizing_of"]

CLUTTER = 0.05
"""Size of every other effect in a case with noise B."""
TIED = 0.30
"""Share of a true cause that its double may leave in a tie."""

_ATTEMPTS = 5
_DOUBLED = 0.3  # size at which a double's changes are taken, small enough to be linear
_PULL_ERROR, _LATE_S = 0.01, 0.002
_SCATTER = {"gain": 5e-4, "stiffness": 1e-3}  # between runs, with noise B
_WINDOW_S = {"clamped": 6.0, "decay": 6.0, "hop": 4.0, "drop": 4.0}
_TRAP_CLUTTER, _TRAP_EFFECTS = 0.1, 8
_SIZES = ("sizes", "share")  # what a label says of how large its effects are

_Amounts = tuple[dict[str, dict[str, float]], dict[str, Any]]


class Robot(NamedTuple):
    """A case's robot: its values, what the model states, and how far a value may lie from that."""

    values: Mapping[str, float]
    stated: Mapping[str, float]
    tolerances: Mapping[str, float]


def generator_of(case: Case) -> Generator:
    """Return the source of a case's motions."""
    shape = load_shape("thesis-initial", Path()).content
    if case.generator == "twin":
        return TwinGenerator(shape)
    return RodGenerator(shape.angles, shape.length)


def robot_of(case: Case) -> Robot:
    """Draw a robot whose base parameters lie anywhere within the model's tolerances."""
    model = load_model("thesis", Path()).content
    stated = model.values()
    tolerances = {name: getattr(model.parameters, name).tolerance for name in stated}
    rng = case.rng(1)
    values = dict(stated)
    for name in BASE:
        values[name] += rng.uniform(-1, 1) * tolerances[name]
    if case.kind == "mass_and_stiffness":
        lighter = [name for name in stated if name.endswith(("_mass", "_stiffness", "_damping"))]
        values = dict(stated) | {name: 0.97 * stated[name] for name in lighter}
    return Robot(values, stated, tolerances)


def sizing_of(case: Case, robot: Robot, runs: Sequence[Plan], shown: str) -> Sizing:
    """Return what sizes causes in a case: on its clamped runs and ring-downs, or on its hops."""
    modes = ("hop",) if shown == "hop" else ("clamped", "decay")
    courses = [_cut(run.course) for run in runs if run.course.mode in modes]
    return Sizing.of(generator_of(case), robot.values, robot.tolerances, courses)


def make_case(case: Case, label: Mapping[str, Any] | None = None) -> Made:
    """Make the runs and the label of a case.

    A robot that falls, or on which its causes cannot be what the case asks, is no case: another is
    drawn in its place, with other runs.

    Args:
        case: drawn.
        label: of this case as it was made before: nothing is sized anew, and the runs are the same.

    Raises:
        UnreachableError: when this was the last robot to be drawn.
        ValueError: when the robot cannot do what is asked, or the label is another case's.
    """
    if label is not None:
        return _made(replace(case, attempt=label["attempt"]), label)
    for attempt in range(_ATTEMPTS - 1):
        with suppress(UnreachableError):
            return _made(replace(case, attempt=attempt))
    return _made(replace(case, attempt=_ATTEMPTS - 1))


def _made(case: Case, before: Mapping[str, Any] | None = None) -> Made:
    robot, rng = robot_of(case), case.rng(2)
    drawn = {
        "seed": case.seed, "attempt": case.attempt,
        "block": case.block, "generator": case.generator, "protocols": case.protocols,
        "noise": case.noise, "kind": case.kind, "reduced": case.reduced,
        "drawn_sizes": list(case.sizes), "values": dict(robot.values),
    }  # fmt: skip
    if before is not None and any(before[key] != value for key, value in drawn.items()):
        raise ValueError(f"{case.name}: the label is another case's")
    runs = plans(case.protocols, rng, case.reduced)
    if before is None:
        effects, sizes = _amounts(case, robot, runs, rng)
    else:
        effects, sizes = _amounts_of(before, case, rng)
    clutter = _clutter(case, effects, rng)
    filmed = _runs(case, robot, runs, effects, clutter, rng)
    label = drawn | {"effects": effects, "clutter": clutter, **sizes, "expected": expected(case)}
    return Made(case, tuple(filmed), label)


def further_runs(made: Made, asked: Sequence[Plan]) -> list[Run]:
    """Make more runs of a case's robot, as a diagnosis asks for them.

    Raises:
        UnreachableError: when the robot falls.
    """
    case, label, first = made.case, made.label, len(made.runs)
    robot = Robot(label["values"], {}, {})
    rng = case.rng(5, first)
    return _runs(case, robot, asked, label["effects"], label["clutter"], rng, first)


def _runs(
    case: Case, robot: Robot, asked: Sequence[Plan], effects: Quantities, clutter: Quantities,
    rng: np.random.Generator, first: int = 0,
) -> list[Run]:  # fmt: skip
    """Return runs as a laboratory has them; `first` is the number of the first."""
    jobs = [_job(case, robot, run, first + k, effects, clutter, rng) for k, run in enumerate(asked)]
    motions = generator_of(case).motions(jobs)
    if any(
        motion.times[-1] < run.course.duration - 1
        for motion, run in zip(motions, asked, strict=True)
    ):
        raise UnreachableError(f"{case.name}: the robot falls")
    return [
        _filmed(case, run, first + k, motion)
        for k, (run, motion) in enumerate(zip(asked, motions, strict=True))
    ]


def _cut(course: Course) -> Course:
    return course._replace(duration=min(course.duration, _WINDOW_S[course.mode]))


def _amounts_of(label: Mapping[str, Any], case: Case, rng: np.random.Generator) -> _Amounts:
    """Return what `_amounts` found when the case was made before; it draws as much."""
    if "sizes" in label:
        for name, _ in zip(case.causes, case.sizes, strict=False):
            direction(name, rng, first=case.block == "tie")
    return label["effects"], {key: label[key] for key in _SIZES if key in label}


def _amounts(case: Case, robot: Robot, runs: Sequence[Plan], rng: np.random.Generator) -> _Amounts:
    """Return the effects of a case, and the sizes that they have."""
    if case.kind == "half_percent_speed":
        return {"speed_scale": {"share": -0.005}}, {}
    if case.kind == "unseen_coulomb":
        return {"hinge_coulomb_friction": {"torque": 1e-5}}, {}
    if case.kind == "nothing_slips":
        return {"friction_level": {"share": 0.3}}, {}
    if case.amounts:
        given: dict[str, dict[str, float]] = {}
        for name, quantity, amount in case.amounts:
            given.setdefault(name, {})[quantity] = amount
        return given, {}
    known, sizings = AMOUNTS | OUTSIDE_AMOUNTS, dict[str, Sizing]()
    effects: dict[str, dict[str, float]] = {}
    reached: dict[str, float] = {}
    for name, target in zip(case.causes, case.sizes, strict=False):
        shown = known[name].shown
        if shown not in sizings:
            sizings[shown] = sizing_of(case, robot, runs, shown)
        unit = direction(name, rng, first=case.block == "tie")
        if case.kind == "softening":
            unit = {key: -abs(value) for key, value in unit.items()}
        effects[name], reached[name] = sizings[shown].scale(
            name, partial(scaled, name, unit), target, known[name].most
        )
    sizes: dict[str, Any] = {"sizes": reached}
    if case.block == "tie":
        sizes["share"] = _share(case, effects, sizings[known[case.causes[0]].shown])
    return effects, sizes


def _share(case: Case, effects: Quantities, sizing: Sizing) -> float:
    """Return what the double leaves of the true cause, each of its quantities in any amount."""
    true, double = case.causes
    ways = AMOUNTS[double].directions
    others = [sizing.change({double: scaled(double, way, _DOUBLED)}) for way in ways]
    share = sizing.share(sizing.change({true: effects[true]}), others)
    if share > TIED:
        left = f"{double} leaves {share:.0%} of {true}, that is no tie"
        raise UnreachableError(f"{case.name}: {left}")
    return share


def _clutter(
    case: Case, effects: Quantities, rng: np.random.Generator
) -> dict[str, dict[str, float]]:
    """Return small amounts of effects that are not the case's own."""
    others = [name for name in AMOUNTS if name not in effects]
    if case.kind == "clutter_only":
        chosen = rng.choice(others, _TRAP_EFFECTS, replace=False)
        return {str(n): scaled(str(n), direction(str(n), rng), _TRAP_CLUTTER) for n in chosen}
    if case.noise == "A":
        return {}
    return {name: scaled(name, direction(name, rng), CLUTTER) for name in others}


def _job(
    case: Case, robot: Robot, run: Plan, k: int, effects: Quantities, clutter: Quantities,
    rng: np.random.Generator,
) -> Job:  # fmt: skip
    """Return one run's motion to ask for, with what differs between runs."""
    values, course = dict(robot.values), run.course
    if case.noise == "B":
        gain = 1 + _SCATTER["gain"] * rng.standard_normal()
        course = course._replace(steps=tuple((t, w * gain) for t, w in course.steps))
        values["hinge_stiffness"] *= 1 + _SCATTER["stiffness"] * rng.standard_normal()
    own = {} if case.kind == "one_run" and k != 0 else effects
    return Job(values, dict(clutter) | dict(own), course)


def _filmed(case: Case, run: Plan, k: int, motion: TimeSeries) -> Run:
    """Return a run as cameras and paper have it."""
    rng = case.rng(3, k)
    fault: Fault = "none"
    if case.block == "sensor":
        fault = next(one for one in FAULTS if one == case.kind)
    elif case.kind == "bad_trackable" and k == 1:
        fault = "slipped_marker"
    seen = film(motion.shifted(-_LATE_S * rng.standard_normal()), case.noise, rng, fault)
    course = run.course
    if course.mode == "decay":
        course = course._replace(pull=course.pull * (1 + _PULL_ERROR * rng.standard_normal()))
    return Run(run.name, run.role, course, seen)
