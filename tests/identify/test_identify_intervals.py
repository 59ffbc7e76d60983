"""The bootstrap: its intervals are as wide as theory says, however short the runs are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identify.robots import MODEL, SHAPE, released
from workbench.identify.intervals import blocks, bootstrap
from workbench.identify.problem import Problem
from workbench.identify.solution import Solution
from workbench.sim import make_robot

ROBOT = make_robot(MODEL.values(), SHAPE)
NAMES = ("hinge_stiffness", "hinge_damping")
DRAWS, SEEDS = 400, 8


def with_noise(solution: Solution, seed: int) -> Solution:
    """The same place, its residuals white noise of the size that the fit was told."""
    noise = np.random.default_rng(seed).standard_normal(len(solution.residuals))
    return replace(solution, residuals=np.where(solution.problem.rows.run < 0, 0.0, noise))


@pytest.fixture(scope="module")
def short() -> Solution:
    """Three ring-downs of a second where their fit would end: at the truth."""
    problem = Problem([released(MODEL, pull, 1.0) for pull in (0.2, 0.4, 0.8)], ROBOT, NAMES)
    return with_noise(Solution.at(problem, problem.start), 0)


def test_a_short_run_has_sixteen_blocks_a_longer_one_one_a_second(short: Solution) -> None:
    assert np.bincount(blocks(short).runs).tolist() == [16] * 3
    assert np.bincount(blocks(short, 0.25, few=1).runs).tolist() == [4] * 3
    assert np.bincount(blocks(short, 0.1).runs).tolist() == [10] * 3


def test_blocks_hold_every_residual_once(short: Solution) -> None:
    found = blocks(short)
    measured = short.problem.rows.run >= 0
    jacobian, weights = short.jacobian[measured], short.weights[measured]
    slope = jacobian.T @ (weights * short.residuals[measured])
    curvature = jacobian.T @ (weights[:, None] * jacobian)
    np.testing.assert_allclose(found.slopes.sum(axis=0), slope)
    np.testing.assert_allclose(found.curvatures.sum(axis=0), curvature)


def test_short_runs_give_intervals_as_wide_as_white_noise_asks_for(short: Solution) -> None:
    widths = []
    for seed in range(SEEDS):
        drawn = bootstrap(with_noise(short, seed), seed, DRAWS)
        widths.append(np.ptp(np.percentile(drawn, [5, 95], axis=0), axis=0))
    theory = 2 * 1.645 * np.sqrt(np.diag(np.linalg.inv(short.information))[: len(NAMES)])
    np.testing.assert_allclose(np.mean(widths, axis=0) / theory, 1.0, atol=0.25)
