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

__all__ = [
    "CLUTTER",
    "ENOUGH",
    "TRIALS",
    "Fit",
    "Prior",
    "Step",
    "fit",
    "prior_of",
    "renewed",
    "step_from",
]

CLUTTER = 0.05
"""Noise deviations (root mean square) that each cause may well contribute unasked."""

ENOUGH = 0.5
"""Of the cost: what noise alone moves it by."""

_ROUGH = 0.01
"""Share of the cost beyond noise: a model that is far off need not be fitted closer."""

_FREE = 1e-8  # precision of a number whose size nobody knows
TRIALS = 24
"""Most steps of a fit, also of those that do not pay."""

_RENEWALS = 2
_MISLED = 5  # trials not believed: a neighbourhood that was taught so often is taken anew
_PATIENCE = 3  # pivots that make nothing better, before they go one at a time
_TRUST = 3.0  # times: a step is believed while the true gain is a third of the expected one
_HARDER, _EASIER = 2.0, 1 / 3  # times the damping, after a step that was not believed or was
_UNDAMPED = 0.01  # of what is expected of an unknown
_RENEWED = 0.01  # of the damping: some of it came of derivatives that were wrong
_ABSURD = 100.0  # times the cost: a robot that cannot stand teaches nothing of one that does


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
        damping: of its last step.
        arrived: whether nothing more was foretold; not, where its trials were used up.
    """

    linear: Linear
    cost: float
    damping: float = 0.0
    arrived: bool = True

    @property
    def z(self) -> NDArray[np.float64]:
        """Return the scaled unknowns, (u,)."""
        return self.linear.z

    @property
    def residuals(self) -> list[NDArray[np.float64]]:
        """Return measured less predicted by run, (m_k,) whitened."""
        return self.linear.residuals

    def apart(self, other: Fit, samples: int) -> float:
        """Return by how many noise deviations two fits' predictions differ, root mean square."""
        return float(np.sqrt(self.linear.apart(other.linear) / samples))


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
    move = cho_solve(cho_factor(damped), slope)
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
    rough: float = _ROUGH,
    trials: int = TRIALS,
    settle: bool = True,
    damping: float = 0.0,
    tell: Progress = lambda text: None,
) -> Fit:
    """Find the minimum of the true problem near a place.

    By damped steps (Levenberg and Marquardt, unknowns in deviations of what is expected), whose
    neighbourhood learns from every trial what it foretold wrongly (Broyden; the secant version in
    Madsen, Nielsen and Tingleff, Methods for non-linear least squares problems, 2004, 3.5). A trial
    simulates every run once, derivatives ten times. The valleys of a lightly damped beam are
    curved: steps that were only cut short stopped on the way down (`tests/diagnose/test_solve.py`).

    Trials are simulated in coarse steps beside a place whose residuals are known; where nothing
    more is foretold, the true residuals are taken, and the fit goes on from there. Where they cost
    more than before, it goes back and on in fine steps.

    Args:
        problem: with its runs.
        z: (u,) where to begin.
        prior: of the unknowns.
        until: how much of each run counts [s].
        linear: a neighbourhood taken nearby.
        refresh: which columns are taken anew; None takes those that are free.
        enough: expected gain of the cost that is worth no further step.
        rough: the same as a share of the cost beyond noise.
        trials: most steps, also of those that do not pay.
        settle: whether to take derivatives anew where nothing more is foretold, and go on once.
        damping: of the first step.
        tell: is told each trial.
    """
    layout, noise = problem.layout, problem.samples(until) / 2
    columns = prior.free if refresh is None else refresh
    learnt = linear is not None and not np.array_equal(linear.z, z)
    if linear is None:
        linear = problem.linear(z, columns, until)
    elif learnt:
        linear = linear.at(z, problem.residuals(z, until))
    cost, harder, misled, renewals = _cost(linear.residuals, z, prior), _HARDER, 0, _RENEWALS
    known, fine = cost, False
    anchor = problem.anchor(linear.z, linear.residuals, until)
    while True:
        curvature, gradient = linear.curvature, linear.gradient
        step = step_from(layout, linear.z, curvature, gradient, prior, damping)
        ended = step.gain < max(enough, rough * (cost - noise))
        wanted = learnt and settle if ended else misled >= _MISLED
        wanted = wanted and renewals > 0 and trials > 0
        if wanted:
            linear, learnt = renewed(problem, linear.z, columns, until, linear), False
            damping, harder, misled, renewals = _RENEWED * damping, _HARDER, 0, renewals - 1
            settle = settle and not ended
        elif ended or trials <= 0:
            if fine or linear.z is anchor.z:
                return Fit(linear, cost, damping, ended)
            linear = linear.at(linear.z, problem.residuals(linear.z, until))
        if wanted or ended or trials <= 0:  # the residuals are the true ones
            cost = _cost(linear.residuals, linear.z, prior)
            if cost > known:
                linear, cost, fine = linear.at(anchor.z, anchor.residuals), known, True
            elif not fine and linear.z is not anchor.z:
                anchor = problem.anchor(linear.z, linear.residuals, until)
            known = cost
            continue
        trials -= 1
        residuals = problem.residuals(step.z, until) if fine else problem.beside(anchor, step.z)
        less = _cost(residuals, step.z, prior)
        tell(f"{less:.1f}, expected {cost - step.gain:.1f}, damping {damping:.2g}")
        if less < _ABSURD * cost:
            linear, learnt = _taught(layout, linear, step.z, residuals, less < cost), True
        kept = (cost - less) / step.gain
        cost = min(cost, less)
        if kept * _TRUST > 1:
            damping *= max(_EASIER, 1 - (2 * min(kept, 1.0) - 1) ** 3)
            damping, harder = damping if damping > _UNDAMPED else 0.0, _HARDER
        else:
            damping, harder, misled = max(damping, 1.0) * harder, 2 * harder, misled + 1


def _taught(
    layout: Layout,
    linear: Linear,
    z: NDArray[np.float64],
    residuals: list[NDArray[np.float64]],
    arrive: bool,
) -> Linear:
    """Return a neighbourhood that foretells a trial: each run's derivatives changed the least.

    Args:
        layout: tells which unknowns a run depends on.
        linear: neighbourhood that the trial was taken from.
        z: (u,) place of the trial.
        residuals: there, by run.
        arrive: whether the trial is the new place, or only taught something of the old one.
    """
    move, matrices = z - linear.z, []
    parts = zip(linear.runs, linear.residuals, residuals, linear.jacobians, strict=True)
    for k, before, after, matrix in parts:
        own = np.flatnonzero((move != 0) & ((layout.run < 0) | (layout.run == k)))
        taught = matrix.copy()
        if len(own):
            missed = before - after - matrix[:, own] @ move[own]
            taught[:, own] += np.outer(missed, move[own] / (move[own] @ move[own]))
        matrices.append(taught)
    return (linear.at(z, residuals) if arrive else linear).with_jacobians(matrices)


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
    return taken.with_jacobians(matrices)


def _cost(residuals: list[NDArray[np.float64]], z: NDArray[np.float64], prior: Prior) -> float:
    return sum(float(part @ part) for part in residuals) / 2 + prior.cost(z)
