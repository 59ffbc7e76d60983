"""How sure a fit is: a block bootstrap of its residuals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.identify.solution import Solution

__all__ = ["BLOCK_S", "Blocks", "blocks", "bootstrap"]

BLOCK_S = 1.0  # longer than what the noise and the robot's faster swings remember
_FEW = 8  # blocks do not tell how they scatter
_INSTEAD = 16  # with eight, the intervals of ring-downs of 1 s were half as wide again as due
_DRAWS = 2000


class Blocks(NamedTuple):
    """Gradient (b, u), curvature (b, u, u) and run (b,) of each block of a fit."""

    slopes: NDArray[np.float64]
    curvatures: NDArray[np.float64]
    runs: NDArray[np.int64]


def bootstrap(solution: Solution, seed: int = 0, draws: int = _DRAWS) -> NDArray[np.float64]:
    """Return redrawn parameters as logarithms of their share, (draws, names).

    Whole blocks of one second are drawn with replacement within each run, so that what hangs
    together in time stays together, and the fit is solved again in its linear neighbourhood
    (one-step bootstrap; Davison and Hinkley 1997, sections 8.2.3 and 7.2). Of b blocks b - 1 are
    drawn and weighted by b / (b - 1), or few blocks would scatter too little (Rao and Wu 1988). A
    run of less than eight seconds has sixteen shorter ones: of one block there is nothing to draw.
    The priors are drawn with their own spread.

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
            often[members] = _redrawn(rng, len(members))
        slope = often @ slopes - total + prior * rng.standard_normal(len(prior))
        curvature = np.tensordot(often, curvatures, axes=1) + np.diag(prior)
        step = np.linalg.lstsq(curvature, slope, rcond=1e-12)[0]
        out[k] = solution.x[:count] - step[:count]
    return out


def blocks(solution: Solution, length: float = BLOCK_S, few: int = _FEW) -> Blocks:
    """Return what each block of a fit says about its unknowns.

    Args:
        solution: with residuals and Jacobian.
        length: of a block, as near as whole blocks fill a run [s].
        few: a run of fewer blocks is cut into sixteen shorter ones.
    """
    rows, weights = solution.problem.rows, solution.weights
    slopes, curvatures, runs = [], [], []
    for run in np.unique(rows.run[rows.run >= 0]):
        own = np.flatnonzero(rows.run == run)
        stop = float(rows.time[own].max())
        share = rows.time[own] / stop
        count = max(1, round(stop / length))
        count = _INSTEAD if count < few else count
        block = np.minimum((count * share).astype(int), count - 1)
        for one in np.unique(block):
            at = own[block == one]
            jacobian, weight = solution.jacobian[at], weights[at]
            slopes.append(jacobian.T @ (weight * solution.residuals[at]))
            curvatures.append(jacobian.T @ (weight[:, None] * jacobian))
            runs.append(run)
    return Blocks(np.array(slopes), np.array(curvatures), np.array(runs))


def _redrawn(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Return how often each of some blocks counts, (count,): once on the mean, variance one."""
    if count == 1:
        return np.ones(1)  # an instant: it cannot be parted
    drawn = rng.multinomial(count - 1, np.full(count, 1 / count))
    return drawn * count / (count - 1)
