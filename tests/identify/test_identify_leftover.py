"""Noise alone is not taken for a lack of the model, however its size was misjudged; a tone is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.identify.robots import MODEL, SHAPE, released
from workbench.identify.leftover import leftover
from workbench.identify.problem import Problem
from workbench.identify.solution import Solution
from workbench.sim import make_robot
from workbench.timeseries import TimeSeries


@pytest.fixture(scope="module")
def problem() -> Problem:
    return Problem([released(MODEL, 0.4, 2.0)], make_robot(MODEL.values(), SHAPE), ())


def left(problem: Problem, residuals: NDArray[np.float64]) -> Solution:
    nothing = np.zeros((len(residuals), len(problem.unknowns)))
    return Solution(problem, problem.start, residuals, nothing)


def white(problem: Problem, seed: int) -> NDArray[np.float64]:
    return np.random.default_rng(seed).standard_normal(len(problem.rows.run))


@pytest.mark.parametrize("size", [0.9, 1.0, 1.3])
def test_noise_of_any_size_is_no_lack(problem: Problem, size: float) -> None:
    found = [leftover(left(problem, size * white(problem, seed))) for seed in range(400)]
    scatter = np.std([one.misfit / one.noise for one in found])
    assert scatter == pytest.approx(found[0].error, rel=0.15)
    assert np.mean([one.noise for one in found]) == pytest.approx(size, rel=0.01)
    assert sum(one.is_more_than_noise for one in found) <= 4  # 0.5 are due


def test_a_slow_motion_below_the_noise_is_a_lack(problem: Problem) -> None:
    tone = 0.6 * np.sin(2 * np.pi * 1.6 * problem.rows.time)
    found = [leftover(left(problem, white(problem, seed) + tone)) for seed in range(50)]
    assert np.mean([one.misfit for one in found]) == pytest.approx(np.sqrt(1.18), rel=0.01)
    assert all(one.noise == pytest.approx(1.0, abs=0.15) for one in found)
    assert sum(one.is_more_than_noise for one in found) >= 40


def test_samples_that_were_not_seen_count_for_neither(problem: Problem) -> None:
    whole = leftover(left(problem, white(problem, 1)))
    (run,) = problem.runs
    valid = run.motion.valid.copy()
    valid[::7] = False
    motion = TimeSeries(run.motion.times, run.motion.values, run.motion.names, valid)
    some = Problem([replace(run, motion=motion)], problem.robot, ())
    found = leftover(left(some, white(problem, 1)))
    assert found.error == pytest.approx(whole.error * np.sqrt(7 / 6), rel=0.01)
    assert found.noise == pytest.approx(1.0, abs=0.15)
