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
from numpy.typing import NDArray
from scipy.linalg import hadamard

from workbench.identify.problem import Problem, needs_no_simulation
from workbench.identify.solution import ROBUST, Solution

__all__ = ["minimum", "slopes_over"]

_FIRST_CHANGE = 3.0  # of the noise, root mean square: how far a cloud reaches at first
_LAST_CHANGE = 1.0
_LEAST_WIDTH, _MOST_WIDTH = 2e-3, 0.05  # of a parameter, share; of what a run keeps, prior
_DAMPING = (0.0, 0.1, 1.0, 10.0)
_ROUNDS = 8
_WON = 1e-3  # share of the cost below which a round changed nothing
_TOGETHER = np.log(3.0)  # a parameter stays within a third and three times its stated value
_REACH = 8.0


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Residuals in the middle of a cloud (m,) and slopes across it (m, u)."""

    middle: NDArray[np.float64]
    jacobian: NDArray[np.float64]


def minimum(problem: Problem, x: NDArray[np.float64]) -> Solution:
    """Return the solution that a fit from unknowns (u,) ends in, its Jacobian over a cloud."""
    cost = float(_costs(problem, problem.residuals(x)[None])[0])
    wanted = _FIRST_CHANGE
    jacobian = problem.jacobian(x)
    for _ in range(_ROUNDS):
        cloud = slopes_over(problem, x, jacobian, _widths(problem, jacobian, wanted))
        jacobian = cloud.jacobian
        places = [_step(problem, x, cloud, damping) for damping in _DAMPING]
        costs = _costs(problem, problem.residuals_of(places))
        best = int(np.argmin(costs))
        won = 1 - float(costs[best]) / cost
        if won > 0:
            x, cost = places[best], float(costs[best])
        if won < _WON:
            if wanted == _LAST_CHANGE:
                break
            wanted = _LAST_CHANGE
    last = slopes_over(problem, x, jacobian, _widths(problem, jacobian, _LAST_CHANGE))
    return Solution(problem, x, problem.residuals(x), last.jacobian)


def slopes_over(
    problem: Problem,
    x: NDArray[np.float64],
    near: NDArray[np.float64],
    widths: NDArray[np.float64],
) -> _Slopes:
    """Regress the residuals over a cloud about unknowns (u,), so wide in each of them (u,).

    Slopes that need no simulation, by a delay or a place, hardly change and are taken from `near`,
    a Jacobian (m, u) close by.
    """
    jacobian = near.copy()
    moved = [i for i, unknown in enumerate(problem.unknowns) if not needs_no_simulation(unknown)]
    column = _columns(problem, moved)
    size = 2 ** int(np.ceil(np.log2(max(column.values(), default=0) + 1)))
    half = hadamard(max(size, 2), dtype=float)[:, 1:]
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


def _widths(
    problem: Problem, jacobian: NDArray[np.float64], wanted: float
) -> NDArray[np.float64]:
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
    reach[: len(problem.names)] = _TOGETHER
    return np.clip(x - step, -reach, reach)


def _costs(problem: Problem, residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the robust cost of each row of residuals (places, m); priors count fully."""
    squares = residuals**2
    soft = 2 * ROBUST**2 * (np.sqrt(1 + squares / ROBUST**2) - 1)
    return np.where(problem.rows.run < 0, squares, soft).sum(axis=1)
