"""Measured runs for tests of the estimator: a motion of either engine as the cameras see it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.bank import observe
from benchmarks.bank.cases_twin import TwinGenerator
from benchmarks.bank.courses import Course, Job, Quantities
from workbench.fit.measured import MeasuredRun
from workbench.fit.systems.hopper import Hopper
from workbench.motion import DRIVEN, FOOT, ROTOR, ROTOR_ANGLE, TOP
from workbench.protocol import load_model, load_shape
from workbench.sim import make_robot
from workbench.timeseries import TimeSeries

NOISE_M = observe.NOISE_M
VALUES = load_model("thesis", Path()).content.values()
SHAPE = load_shape("thesis-initial", Path()).content
ROBOT = make_robot(VALUES, SHAPE)


def ramp(speed: float) -> tuple[tuple[float, float], ...]:
    """The steps of a ramp of half a second to a speed."""
    return tuple((0.1 * k, speed * (k + 1) / 6) for k in range(6))


def twin_motion(course: Course, effects: Quantities | None = None) -> TimeSeries:
    """What the twin does, noise-free."""
    return TwinGenerator(SHAPE).motions([Job(VALUES, effects or {}, course)])[0]


def measured(motion: TimeSeries, course: Course, seed: int = 0) -> MeasuredRun:
    """A motion as cameras with 0.3 mm of white noise see it."""
    seen = observe.film(motion, "A", np.random.default_rng(seed))
    paths = dict(zip(("foot", "top", "rotor"), (FOOT, TOP, ROTOR), strict=True))
    columns = {
        name: column
        for body, names in paths.items()
        for name, column in zip(names, seen.paths[body].T, strict=True)
    }
    series = TimeSeries.of(seen.times, columns | {ROTOR_ANGLE: seen.rotor_angle})
    still = seen.times < 0
    return MeasuredRun(
        f"{course.mode} run",
        course.mode,
        series.between(-np.inf, course.duration),
        course.steps if course.mode in DRIVEN else (),
        float(np.nanmedian(seen.rotor_angle[still])),
        course.pull,
        course.height,
    )


def hopper(motion: TimeSeries, course: Course, seed: int = 0) -> Hopper:
    """The nominal robot with one measured run."""
    return Hopper(ROBOT, [measured(motion, course, seed)])
