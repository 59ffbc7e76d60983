"""Measured runs for tests of the estimator: a motion of either engine as the cameras see it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.bank import observe
from benchmarks.bank.cases import Run
from benchmarks.bank.cases_twin import TwinGenerator
from benchmarks.bank.courses import Course, Job, Quantities
from benchmarks.bank.write import measured_run
from workbench.fit import Hopper, MeasuredRun
from workbench.schemas import load_model, load_shape
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


def measured(motion: TimeSeries, course: Course, seed: int | list[int] = 0) -> MeasuredRun:
    """A motion as cameras with 0.3 mm of white noise see it."""
    seen = observe.film(motion, "A", np.random.default_rng(seed))
    return measured_run(Run(f"{course.mode} run", "train", course, seen))


def hopper(motion: TimeSeries, course: Course, seed: int = 0) -> Hopper:
    """The nominal robot with one measured run."""
    return Hopper(ROBOT, [measured(motion, course, seed)])
