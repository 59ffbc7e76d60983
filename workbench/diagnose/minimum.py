"""Minima of the linear neighbourhood, within bounds and what is expected of the unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.layout import Layout

__all__ = ["CLUTTER", "Prior", "Step", "prior_of", "step_from"]

CLUTTER = 0.05
"""Noise deviations (root mean square) that each cause may well contribute unasked."""

_FREE = 1e-8  # precision of a number whose size nobody knows
_PATIENCE = 3  # pivots that make nothing better, before they go one at a time


@dataclass(frozen=True, eq=False)
class Prior:
    """What is expected of the unknowns.

    Args:
        precision: (u,) one over the square of the deviation from zero, scaled.
        free: (f,) indices of the unknowns that may move.
    """

    precision: NDArray[np.float64]
    free: NDArray[np.int_]

    def added_to(self, curvature: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the curvature (u, u) with what is expected, of those that may move, (f, f)."""
        return curvature[np.ix_(self.free, self.free)] + np.diag(self.precision[self.free])

    def cost(self, z: NDArray[np.float64]) -> float:
        """Return half the squares of how far unknowns (u,) are from what is expected."""
        return float(self.precision[self.free] @ z[self.free] ** 2) / 2


@dataclass(frozen=True, eq=False)
class Step:
    """The minimum of a linear neighbourhood.

    Args:
        z: (u,) where it lies.
        gain: by how much the cost falls, expected.
    """

    z: NDArray[np.float64]
    gain: float


def prior_of(
    layout: Layout,
    released: tuple[str, ...] = (),
    clutter: NDArray[np.float64] | None = None,
) -> Prior:
    """Return what is expected: base within tolerance, own within reach, causes absent or released.

    A base number whose release is a cause here stays where it is.

    Args:
        layout: of the unknowns.
        released: causes whose quantities may take any possible value.
        clutter: (u,) deviations of the quantities of all other causes; None keeps them at zero.
    """
    precision = np.ones(len(layout))
    free = np.ones(len(layout), dtype=bool)
    quantities = layout.quantities(tuple(layout.of_cause))
    if clutter is None:
        free[quantities] = False
    else:
        known = clutter[quantities] > 0
        precision[quantities[known]] = clutter[quantities[known]] ** -2
        free[quantities[~known]] = False
    chosen = layout.quantities(released)
    precision[chosen], free[chosen] = _FREE, True
    free[layout.replaced(released)] = False
    return Prior(precision, np.flatnonzero(free))


def step_from(
    layout: Layout,
    z: NDArray[np.float64],
    curvature: NDArray[np.float64],
    gradient: NDArray[np.float64],
    prior: Prior,
    damping: float = 0.0,
) -> Step:
    """Return the minimum of a linear neighbourhood within all bounds.

    Args:
        layout: with the bounds.
        z: (u,) where the neighbourhood was taken.
        curvature: (u, u) sum of J^T J over the runs that count.
        gradient: (u,) sum of J^T r.
        prior: of the unknowns.
        damping: precision with which unknowns are held where they are.
    """
    free = prior.free
    matrix = prior.added_to(curvature)
    damped = matrix + damping * np.eye(len(free))
    slope = gradient[free] - prior.precision[free] * z[free]
    move = scipy.linalg.cho_solve(scipy.linalg.cho_factor(damped), slope)
    low, high = layout.low[free] - z[free], layout.high[free] - z[free]
    if np.any(move < low - 1e-9) or np.any(move > high + 1e-9):
        move = _within(damped, slope, np.minimum(low, 0.0), np.maximum(high, 0.0))
    there = z.copy()
    there[free] += move
    return Step(there, float(slope @ move - move @ matrix @ move / 2))


def _within(
    matrix: NDArray[np.float64],
    slope: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the minimum of m^T A m / 2 - s^T m between bounds, (f,).

    By block pivots (Judice and Pires 1994, doi:10.1016/0305-0548(94)90106-6): what is beyond its
    bound is held there, what pulls away from it is let go, all at once, until nothing changes;
    where that goes in circles, one at a time, which always ends (Murty 1974). Some five solutions
    do, where changing one at a time from the start (`scipy.optimize.lsq_linear`) takes a hundred,
    and screening asks for hundreds of minima.
    """
    size = np.diag(matrix)
    side = np.zeros(len(slope), dtype=int)  # of what is held: 1 at its upper bound, -1 at its lower
    fewest, patience = len(slope) + 1, _PATIENCE
    while True:
        held, loose = np.flatnonzero(side), np.flatnonzero(side == 0)
        move = np.where(side > 0, high, low)
        rest = slope[loose] - matrix[np.ix_(loose, held)] @ move[held]
        move[loose] = scipy.linalg.cho_solve(
            scipy.linalg.cho_factor(matrix[np.ix_(loose, loose)]), rest
        )
        pull = np.zeros(len(slope))
        pull[held] = slope[held] - matrix[held] @ move
        ahead = move + pull / size
        wanted = (ahead > high).astype(int) - (ahead < low).astype(int)
        wrong = np.flatnonzero(wanted != side)
        if not len(wrong):
            return move
        patience = _PATIENCE if len(wrong) < fewest else patience - 1
        fewest = min(fewest, len(wrong))
        changed = wrong if patience > 0 else wrong[-1:]
        side[changed] = wanted[changed]
