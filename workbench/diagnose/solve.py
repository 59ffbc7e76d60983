"""Minima of the linear neighbourhood, and the way from minimum to minimum of the true problem.

What is minimised is the sum of squares of whitened residuals and of the distances of unknowns from
what is expected of them, in deviations of their priors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from workbench.diagnose.layout import Layout
from workbench.diagnose.problem import Linear, Problem
from workbench.progress import Progress

__all__ = ["CLUTTER", "ENOUGH", "Fit", "Prior", "Step", "fit", "prior_of", "renewed", "step_from"]

CLUTTER = 0.05
"""Noise deviations (root mean square) that each cause may well contribute unasked."""

ENOUGH = 0.5
"""Of the cost: what noise alone moves it by."""

_ROUGH = 0.01
"""Share of the cost beyond noise: a model that is far off need not be fitted closer."""

_FREE = 1e-8  # precision of a number whose size nobody knows
_ROUNDS = 8
_CUTS = 4
_PATIENCE = 3  # pivots that make nothing better, before they go one at a time
_NO_WAY = 0.1  # share of the expected gain
_TRUST = 3.0  # times: a step is believed while the true gain is a third of the expected one


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


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Args:
        linear: the neighbourhood used last, with the residuals where the fit ended.
        cost: half the sum of squares, priors included.
    """

    linear: Linear
    cost: float

    @property
    def z(self) -> NDArray[np.float64]:
        """Return the scaled unknowns, (u,)."""
        return self.linear.z

    @property
    def residuals(self) -> list[NDArray[np.float64]]:
        """Return measured less predicted by run, (m_k,) whitened."""
        return self.linear.residuals

    def apart(self, other: Fit, samples: int) -> float:
        """Return the root mean square over samples by which the predictions of two fits differ."""
        pairs = zip(self.residuals, other.residuals, strict=True)
        return float(np.sqrt(sum(float(np.sum((a - b) ** 2)) for a, b in pairs) / samples))


def prior_of(
    layout: Layout,
    released: tuple[str, ...] = (),
    clutter: NDArray[np.float64] | None = None,
) -> Prior:
    """Return what is expected: base within tolerance, own within reach, causes absent or released.

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
    return Prior(precision, np.flatnonzero(free))


def step_from(
    layout: Layout,
    z: NDArray[np.float64],
    curvature: NDArray[np.float64],
    gradient: NDArray[np.float64],
    prior: Prior,
) -> Step:
    """Return the minimum of a linear neighbourhood within all bounds.

    Args:
        layout: with the bounds.
        z: (u,) where the neighbourhood was taken.
        curvature: (u, u) sum of J^T J over the runs that count.
        gradient: (u,) sum of J^T r.
        prior: of the unknowns.
    """
    free = prior.free
    matrix = prior.added_to(curvature)
    slope = gradient[free] - prior.precision[free] * z[free]
    move = cho_solve(cho_factor(matrix), slope)
    low, high = layout.low[free] - z[free], layout.high[free] - z[free]
    if np.any(move < low - 1e-9) or np.any(move > high + 1e-9):
        move = _within(matrix, slope, np.minimum(low, 0.0), np.maximum(high, 0.0))
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
        move[loose] = cho_solve(cho_factor(matrix[np.ix_(loose, loose)]), rest)
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


def fit(
    problem: Problem,
    z: NDArray[np.float64],
    prior: Prior,
    until: float = np.inf,
    linear: Linear | None = None,
    refresh: NDArray[np.int_] | None = None,
    enough: float = ENOUGH,
    rounds: int = _ROUNDS,
    tell: Progress = lambda text: None,
) -> Fit:
    """Find the minimum of the true problem near a place.

    The neighbourhood is used as long as it foretells what a step gains, then it is taken anew.

    Args:
        problem: with its runs.
        z: (u,) where to begin.
        prior: of the unknowns.
        until: how much of each run counts [s].
        linear: a neighbourhood taken nearby.
        refresh: which columns are taken anew; None takes those that are free.
        enough: expected gain of the cost that is worth no further step.
        rounds: most steps.
        tell: is told each round.
    """
    layout, noise = problem.layout, problem.samples(until) / 2
    columns = prior.free if refresh is None else refresh
    fresh = linear is None
    if linear is None:
        linear = problem.linear(z, columns, until)
    elif not np.array_equal(linear.z, z):
        linear = linear.at(z, problem.residuals(z, until))
    cost = _cost(linear.residuals, z, prior)
    for _ in range(rounds):
        step = step_from(layout, z, linear.curvatures.sum(0), linear.gradients.sum(0), prior)
        if step.gain < max(enough, _ROUGH * (cost - noise)):
            break
        linear, less = _believed(problem, linear, step, prior, until, cost)
        gained = cost - less
        tell(f"{less:.1f}, expected {cost - step.gain:.1f}")
        z, cost = linear.z, less
        if fresh and gained < max(enough, _NO_WAY * step.gain):
            break  # fresh derivatives foretell what is not there: the cost is rough
        fresh = gained * _TRUST < step.gain
        if fresh:
            linear = renewed(problem, z, columns, until, linear)
    return Fit(linear, cost)


def renewed(
    problem: Problem,
    z: NDArray[np.float64],
    columns: NDArray[np.int_],
    until: float,
    before: Linear,
) -> Linear:
    """Return a neighbourhood with some columns taken anew and the others kept."""
    taken = problem.linear(z, columns, until)
    matrices = []
    for old, new in zip(before.jacobians, taken.jacobians, strict=True):
        mixed = old.copy()
        mixed[:, columns] = new[:, columns]
        matrices.append(mixed)
    curvatures = np.array([matrix.T @ matrix for matrix in matrices])
    return Linear(z, taken.runs, taken.residuals, matrices, curvatures)


def _believed(
    problem: Problem,
    linear: Linear,
    step: Step,
    prior: Prior,
    until: float,
    cost: float,
) -> tuple[Linear, float]:
    """Go along a step, a third as far each time it does not pay; stay where it never does."""
    share = 1.0
    for _ in range(_CUTS):
        there = linear.z + share * (step.z - linear.z)
        residuals = problem.residuals(there, until)
        less = _cost(residuals, there, prior)
        if less < cost:
            return linear.at(there, residuals), less
        share /= 3
    return linear, cost


def _cost(residuals: list[NDArray[np.float64]], z: NDArray[np.float64], prior: Prior) -> float:
    return sum(float(part @ part) for part in residuals) / 2 + prior.cost(z)
