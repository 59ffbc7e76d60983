"""How many increments a beam has that follows the runs best, and what not knowing it costs.

A chain of n rigid pieces rings as a smooth strip does but for a share that falls with 1/n^2. Where
the model's own chain cannot follow the runs, its number of pieces is therefore one more unknown:
stiffness fitted with 32 pieces to a beam of 40 comes out 0.1 % high, ten times what noise leaves
open. The number is found as any unknown is, by Gauss-Newton steps; but its derivative is taken
along the best fits of two chains, because at fixed stiffness another chain runs out of phase within
seconds, and residuals so far apart tell no slope.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.identify.problem import Problem
from workbench.identify.solution import ROBUST, Solution

__all__ = ["FINEST", "Meshed", "best_mesh"]

FINEST = 48  # increments: the engine's step shrinks with their square
_BESIDE = float(np.sqrt(2))  # times as many increments: half of 1/n^2
_ROUNDS = 3
_STEPS = 12
_DONE = 0.02  # of the cost: what the last step may still have gained


@dataclass(frozen=True, eq=False)
class Meshed:
    """A fit with the number of increments that the runs ask for.

    Args:
        solution: with that number; its derivatives are those of the fit that it began from.
        path: (u,) how the unknowns follow 1/increments^2, in units of its own value.
        slope: (m,) how the residuals follow it where all unknowns are held.
        evaluations: how often all runs were simulated for residuals.
    """

    solution: Solution
    path: NDArray[np.float64]
    slope: NDArray[np.float64]
    evaluations: int

    @property
    def with_mesh(self) -> Solution:
        """Return the solution with the mesh as a last unknown, zero there, its prior one wide.

        From it the intervals learn that the number of increments was fitted as well.
        """
        at = self.solution
        jacobian = np.column_stack([at.jacobian, self.slope])
        return Solution(at.problem, np.append(at.x, 0.0), at.residuals, jacobian)


def best_mesh(solution: Solution, path: NDArray[np.float64] | None = None) -> Meshed:
    """Return the fit with as many increments as the runs ask for, at most `FINEST`.

    Args:
        solution: with some number of increments.
        path: as a fit of a part of the runs left it; spares work.
    """
    chord = _Chord(solution, path)
    count = solution.problem.robot.increments
    finer = round(count * _BESIDE)
    chord.fit(finer if finer <= FINEST else round(count / _BESIDE))
    for _ in range(_ROUNDS):
        wanted = _wanted(*chord.best_two())
        if wanted in {one.increments for one in chord.seen}:
            break
        chord.fit(wanted)
    best, other = chord.best_two()
    share = (other.u - best.u) / best.u
    along = (other.residuals - best.residuals) / share
    path = (other.x - best.x) / share
    final = Solution(best.problem, best.x, best.residuals, solution.jacobian)
    return Meshed(final, path, along - solution.jacobian @ path, chord.evaluations)


def _with_increments(problem: Problem, increments: int) -> Problem:
    """Return the same problem for a beam of another number of increments."""
    robot = replace(problem.robot, increments=increments)
    other = Problem(problem.runs, robot, problem.names, problem.window, problem.threads)
    other.steps = problem.steps.copy()
    return other


@dataclass(frozen=True, eq=False)
class _Place:
    problem: Problem
    x: NDArray[np.float64]
    residuals: NDArray[np.float64]

    @property
    def increments(self) -> int:
        return self.problem.robot.increments

    @property
    def u(self) -> float:
        return 1 / self.increments**2

    @property
    def cost(self) -> float:
        rows = self.problem.rows.run < 0
        soft = 2 * ROBUST**2 * (np.sqrt(1 + (self.residuals / ROBUST) ** 2) - 1)
        return 0.5 * float(np.sum(np.where(rows, self.residuals**2, soft)))


class _Chord:
    """Fits beside a fit, with the derivatives of that one: they are nearly those of the others."""

    def __init__(self, solution: Solution, path: NDArray[np.float64] | None) -> None:
        self.start = _Place(solution.problem, solution.x, solution.residuals)
        self.path = np.zeros(len(solution.x)) if path is None else path
        self.jacobian = solution.jacobian
        self.seen = [self.start]
        self.evaluations = 0

    def fit(self, increments: int) -> _Place:
        """Return the best fit with a number of increments."""
        problem = _with_increments(self.start.problem, increments)
        at = self._place(problem, self._guess(1 / increments**2))
        for _ in range(_STEPS):
            step, gain = self._step(at)
            if gain < _DONE:
                break
            ahead = self._place(problem, at.x + step)
            while ahead.cost > at.cost and gain > _DONE:
                step, gain = step / 4, gain / 4
                ahead = self._place(problem, at.x + step)
            if ahead.cost >= at.cost:
                break
            at = ahead
        self.seen.append(at)
        return at

    def _guess(self, u: float) -> NDArray[np.float64]:
        """Return where the fits seen so far lead, in a straight line of 1/increments^2."""
        if len(self.seen) == 1:
            return self.start.x + self.path * (u / self.start.u - 1)
        a, b = sorted(self.seen, key=lambda one: abs(one.u - u))[:2]
        return a.x + (b.x - a.x) * (u - a.u) / (b.u - a.u)

    def best_two(self) -> tuple[_Place, _Place]:
        """Return the best fit, and the one nearest to it in 1/increments^2."""
        best = min(self.seen, key=lambda one: one.cost)
        others = [one for one in self.seen if one is not best]
        return best, min(others, key=lambda one: abs(one.u - best.u))

    def _place(self, problem: Problem, x: NDArray[np.float64]) -> _Place:
        self.evaluations += 1
        return _Place(problem, x, problem.residuals(x))

    def _step(self, at: _Place) -> tuple[NDArray[np.float64], float]:
        """Return the Gauss-Newton step, and what it should gain."""
        weights = Solution(at.problem, at.x, at.residuals, self.jacobian).weights
        slope = self.jacobian.T @ (weights * at.residuals)
        curvature = self.jacobian.T @ (weights[:, None] * self.jacobian)
        step = np.asarray(-np.linalg.lstsq(curvature, slope, rcond=1e-12)[0], dtype=np.float64)
        return step, -0.5 * float(slope @ step)


def _wanted(best: _Place, other: _Place) -> int:
    """Return the number of increments where the line through two fits' residuals is least."""
    along = (other.residuals - best.residuals) / (other.u - best.u)
    weights = Solution(best.problem, best.x, best.residuals, np.empty(0)).weights
    move = -float(along @ (weights * best.residuals)) / float(along @ (weights * along))
    u = max(best.u + move, 1 / FINEST**2)
    return round(float(np.sqrt(1 / u)))
