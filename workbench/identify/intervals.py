"""How sure a fit is: a block bootstrap of its residuals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.identify.solution import Solution

__all__ = ["BLOCK_S", "blocks", "bootstrap"]

BLOCK_S = 1.0  # longer than what the noise and the robot's faster swings remember
_DRAWS = 2000


def bootstrap(solution: Solution, seed: int = 0, draws: int = _DRAWS) -> NDArray[np.float64]:
    """Return redrawn parameters as logarithms of their share, (draws, names).

    Whole blocks of one second are drawn with replacement within each run, so that what hangs
    together in time stays together, and the fit is solved again in its linear neighbourhood
    (one-step bootstrap; Davison and Hinkley 1997, sections 8.2.3 and 7.2). The priors are drawn
    with their own spread.

    Args:
        solution: with residuals and Jacobian.
        seed: the same seed gives the same draws.
        draws: how many.
    """
    rng = np.random.default_rng(seed)
    count = len(solution.problem.names)
    slopes, curvatures, runs = blocks(solution)
    prior = np.zeros(len(solution.x))
    prior[count:] = 1.0
    total = slopes.sum(axis=0)
    strata = [np.flatnonzero(runs == run) for run in np.unique(runs)]
    out = np.empty((draws, count))
    for k in range(draws):
        often = np.zeros(len(runs))
        for members in strata:
            often[members] = rng.multinomial(len(members), np.full(len(members), 1 / len(members)))
        slope = often @ slopes - total + prior * rng.standard_normal(len(prior))
        curvature = np.tensordot(often, curvatures, axes=1) + np.diag(prior)
        step = np.linalg.lstsq(curvature, slope, rcond=1e-12)[0]
        out[k] = solution.x[:count] - step[:count]
    return out


def blocks(
    solution: Solution, length: float = BLOCK_S
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return gradient (b, u), curvature (b, u, u) and run (b,) of each block of so many seconds."""
    rows, weights = solution.problem.rows, solution.weights
    key = rows.run * 100_000 + np.floor(rows.time / length).astype(np.int64)
    keys = np.unique(key[rows.run >= 0])
    slopes, curvatures = [], []
    for one in keys:
        at = np.flatnonzero((key == one) & (rows.run >= 0))
        jacobian, weight = solution.jacobian[at], weights[at]
        slopes.append(jacobian.T @ (weight * solution.residuals[at]))
        curvatures.append(jacobian.T @ (weight[:, None] * jacobian))
    return np.array(slopes), np.array(curvatures), keys // 100_000
