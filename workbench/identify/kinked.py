"""Least squares where friction puts kinks: slopes from a cloud of simulations, not from a point.

A corner that locks one engine step earlier moves what follows by a tenth of the noise, so the cost
of a hop is jagged below some tenths of a percent of a friction level, and a fine finite difference
measures the teeth. Here slopes and residuals are regressed over a two-level design with fold-over
(Box, Hunter and Hunter 2005, chapter 6): a Hadamard matrix and its mirror image. The unknowns do
not mix, even effects cancel out of the slopes, and the teeth are averaged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.identify.intervals import blocks
from workbench.identify.problem import Problem, needs_no_simulation
from workbench.identify.solution import ROBUST, Solution

__all__ = ["Minimum", "minimum", "redrawn", "slopes_over"]

_FIRST_CHANGE = 3.0  # of the noise, root mean square, by one unknown: a cloud's reach at first
_LAST_CHANGE = 1.0
_LEAST_WIDTH, _MOST_WIDTH = 2e-3, 0.05  # of a parameter, share; of what a run keeps, prior
_DAMPING = (0.0, 0.1, 1.0, 10.0)
_ROUNDS = 8
_WON_FIRST = 1e-2  # share of the cost below which a wide cloud has done its work
_WON = 2.0  # cost; one is what a single parameter's standard error is worth
_LAST_CLOUDS = 3
_BLOCK_S = 0.25  # less than a hop, more than an impact
_DRAWS = 2000
_LARGEST = np.log(3.0)  # a parameter stays within a third and three times its stated value
_REACH = 8.0


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Residuals in the middle of a cloud (m,) and slopes across it (m, u)."""

    middle: NDArray[np.float64]
    jacobian: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum, found to within the kinks.

    Args:
        solution: with its Jacobian over a cloud.
        error: (names,) standard error of the minimum itself, from cloud to cloud, log share.
    """

    solution: Solution
    error: NDArray[np.float64]


def minimum(problem: Problem, x: NDArray[np.float64]) -> Minimum:
    """Return where a fit from unknowns (u,) ends: the mean of what several clouds say."""
    cost = float(_costs(problem, problem.residuals(x)[None])[0])
    wanted = _FIRST_CHANGE
    jacobian = problem.jacobian(x)
    for turn in range(_ROUNDS):
        cloud = slopes_over(problem, x, jacobian, _widths(problem, jacobian, wanted), turn)
        jacobian = cloud.jacobian
        places = [_step(problem, x, cloud, damping) for damping in _DAMPING]
        costs = _costs(problem, problem.residuals_of(places))
        best = int(np.argmin(costs))
        won = cost - float(costs[best])
        if won > 0:
            x, cost = places[best], float(costs[best])
        if wanted == _LAST_CHANGE and won < _WON:
            break
        if won < _WON_FIRST * cost:
            wanted = _LAST_CHANGE
    widths = _widths(problem, jacobian, _LAST_CHANGE)
    clouds = [slopes_over(problem, x, jacobian, widths, turn) for turn in range(_LAST_CLOUDS)]
    ends = np.array([_step(problem, x, cloud, 0.0) for cloud in clouds])
    jacobian = np.mean([cloud.jacobian for cloud in clouds], axis=0)
    x = ends.mean(axis=0)  # the mean of several clouds is nearer to the valley's floor than one
    solution = Solution(problem, x, problem.residuals(x), jacobian)
    error = ends.std(axis=0, ddof=1) / np.sqrt(_LAST_CLOUDS)
    return Minimum(solution, error[: len(problem.names)])


def redrawn(minimum: Minimum, seed: int, draws: int = _DRAWS) -> NDArray[np.float64]:
    """Return redrawn parameters as logarithms of their share, (draws, names).

    What tells a friction level is over in a few tenths of a second, and a bootstrap that leaves
    this part out knows nothing of it. So the curvature is kept and only the gradient of each
    quarter second gets a random weight (score bootstrap; Kline and Santos 2012). Few parts scatter
    too little by chance: no parameter is told better than white noise would allow. What the kinks
    leave unsure about the minimum itself is added, by Student's distribution for so few clouds.
    """
    rng = np.random.default_rng(seed)
    solution, count = minimum.solution, len(minimum.error)
    slopes = blocks(solution, _BLOCK_S, few=1).slopes
    prior = np.where(np.arange(len(solution.x)) < count, 0.0, 1.0)
    scores = rng.standard_normal((draws, len(slopes))) @ slopes
    scores += prior * rng.standard_normal((draws, len(prior)))
    covariance = np.linalg.pinv(solution.information)
    moved = (scores @ covariance)[:, :count]
    white = np.sqrt(np.diag(covariance)[:count])
    moved *= np.maximum(1.0, white / np.maximum(moved.std(axis=0), 1e-12))
    kinks = minimum.error * rng.standard_t(_LAST_CLOUDS - 1, moved.shape)
    return solution.x[:count] + moved + kinks


def slopes_over(
    problem: Problem,
    x: NDArray[np.float64],
    near: NDArray[np.float64],
    widths: NDArray[np.float64],
    turn: int = 0,
) -> _Slopes:
    """Regress the residuals over a cloud about unknowns (u,), so wide in each of them (u,).

    Another turn puts the unknowns on other columns of the design: another cloud.

    Slopes that need no simulation, by a delay or a place, hardly change and are taken from `near`,
    a Jacobian (m, u) close by.
    """
    jacobian = near.copy()
    moved = [i for i, unknown in enumerate(problem.unknowns) if not needs_no_simulation(unknown)]
    column = _columns(problem, moved)
    size = 2 ** int(np.ceil(np.log2(max(column.values(), default=0) + 1)))
    half = np.roll(scipy.linalg.hadamard(max(size, 2)).astype(float)[:, 1:], turn, axis=1)
    half *= 1 - 2 * ((turn + np.arange(half.shape[1])) % 3 == 0)
    design = np.vstack([half, -half])
    places = []
    for signs in design:
        place = x.copy()
        for i in moved:
            place[i] += widths[i] * signs[column[i] - 1]
        places.append(place)
    found = problem.residuals_of(places)
    for i in moved:
        slope = design[:, column[i] - 1] @ found / (len(design) * widths[i])
        jacobian[:, i] = np.where(_touched(problem, i), slope, near[:, i])
    return _Slopes(found.mean(axis=0), jacobian)


def _columns(problem: Problem, moved: list[int]) -> dict[int, int]:
    """Return the column of the design, from 1, that moves each unknown; runs share columns."""
    count = len(problem.names)
    column: dict[int, int] = {}
    used: dict[int, int] = {}
    for i in moved:
        run = problem.unknowns[i].run
        if run < 0:
            column[i] = i + 1
        else:
            used[run] = used.get(run, count) + 1
            column[i] = used[run]
    return column


def _widths(problem: Problem, jacobian: NDArray[np.float64], wanted: float) -> NDArray[np.float64]:
    """Return how far to move each unknown for a change of so many noise deviations, (u,)."""
    widths = np.empty(jacobian.shape[1])
    for i in range(len(widths)):
        size = float(np.sqrt(np.mean(jacobian[_touched(problem, i), i] ** 2)))
        widths[i] = wanted / max(size, wanted / _MOST_WIDTH)
    parameters = np.arange(len(widths)) < len(problem.names)
    return np.where(parameters, np.maximum(widths, _LEAST_WIDTH), widths)


def _touched(problem: Problem, i: int) -> NDArray[np.bool_]:
    """Return which measured rows an unknown can move, (m,)."""
    own, run = problem.unknowns[i].run, problem.rows.run
    return run >= 0 if own < 0 else run == own


def _step(
    problem: Problem, x: NDArray[np.float64], cloud: _Slopes, damping: float
) -> NDArray[np.float64]:
    at = Solution(problem, x, cloud.middle, cloud.jacobian)
    information = at.information
    scale = np.diag(np.diag(information)) * damping
    slope = cloud.jacobian.T @ (at.weights * cloud.middle)
    step = np.linalg.lstsq(information + scale, slope, rcond=1e-12)[0]
    reach = np.full(len(x), _REACH)
    reach[: len(problem.names)] = _LARGEST
    return np.clip(x - step, -reach, reach)


def _costs(problem: Problem, residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the robust cost of each row of residuals (places, m); priors count fully."""
    squares = residuals**2
    soft = 2 * ROBUST**2 * (np.sqrt(1 + squares / ROBUST**2) - 1)
    return np.where(problem.rows.run < 0, squares, soft).sum(axis=1)
