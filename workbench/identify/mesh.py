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
    count = _increments(solution)
    finer = round(count * _BESIDE)
    chord.fit(finer if finer <= FINEST else round(count / _BESIDE))
    for _ in range(_ROUNDS):
        wanted = _wanted(*chord.best_two())
        if wanted in map(_increments, chord.seen):
            break
        chord.fit(wanted)
    best, other = chord.best_two()
    share = _u(other) / _u(best) - 1
    along = (other.residuals - best.residuals) / share
    path = (other.x - best.x) / share
    return Meshed(best, path, along - solution.jacobian @ path, chord.evaluations)


def _with_increments(problem: Problem, increments: int) -> Problem:
    """Return the same problem for a beam of another number of increments."""
    robot = replace(problem.robot, increments=increments)
    other = Problem(problem.runs, robot, problem.names, problem.window, problem.threads)
    other.steps = problem.steps.copy()
    return other


def _increments(one: Solution) -> int:
    return one.problem.robot.increments


def _u(one: Solution) -> float:
    """Return 1/increments^2."""
    return 1 / _increments(one) ** 2


def _cost(one: Solution) -> float:
    """Return what a fit of whole runs minimises."""
    soft = 2 * ROBUST**2 * (np.sqrt(1 + (one.residuals / ROBUST) ** 2) - 1)
    return 0.5 * float(np.sum(np.where(one.problem.rows.run < 0, one.residuals**2, soft)))


class _Chord:
    """Fits beside a fit, with the derivatives of that one: they are nearly those of the others."""

    def __init__(self, solution: Solution, path: NDArray[np.float64] | None) -> None:
        self.start = solution
        self.path = np.zeros(len(solution.x)) if path is None else path
        self.seen = [solution]
        self.evaluations = 0

    def fit(self, increments: int) -> Solution:
        """Return the best fit with a number of increments."""
        problem = _with_increments(self.start.problem, increments)
        at = self._place(problem, self._guess(1 / increments**2))
        for _ in range(_STEPS):
            step, gain = _step(at)
            if gain < _DONE:
                break
            ahead = self._place(problem, at.x + step)
            while _cost(ahead) > _cost(at) and gain > _DONE:
                step, gain = step / 4, gain / 4
                ahead = self._place(problem, at.x + step)
            if _cost(ahead) >= _cost(at):
                break
            at = ahead
        self.seen.append(at)
        return at

    def _guess(self, u: float) -> NDArray[np.float64]:
        """Return where the fits seen so far lead, in a straight line of 1/increments^2."""
        if len(self.seen) == 1:
            return self.start.x + self.path * (u / _u(self.start) - 1)
        a, b = sorted(self.seen, key=lambda one: abs(_u(one) - u))[:2]
        return a.x + (b.x - a.x) * (u - _u(a)) / (_u(b) - _u(a))

    def best_two(self) -> tuple[Solution, Solution]:
        """Return the best fit, and the one nearest to it in 1/increments^2."""
        best = min(self.seen, key=_cost)
        others = [one for one in self.seen if one is not best]
        return best, min(others, key=lambda one: abs(_u(one) - _u(best)))

    def _place(self, problem: Problem, x: NDArray[np.float64]) -> Solution:
        self.evaluations += 1
        return Solution(problem, x, problem.residuals(x), self.start.jacobian)


def _step(at: Solution) -> tuple[NDArray[np.float64], float]:
    """Return the Gauss-Newton step, and what it should gain."""
    slope = at.jacobian.T @ (at.weights * at.residuals)
    step = np.asarray(-np.linalg.lstsq(at.information, slope, rcond=1e-12)[0], dtype=np.float64)
    return step, -0.5 * float(slope @ step)


def _wanted(best: Solution, other: Solution) -> int:
    """Return the number of increments where the line through two fits' residuals is least."""
    along = (other.residuals - best.residuals) / (_u(other) - _u(best))
    move = -float(along @ (best.weights * best.residuals)) / float(along @ (best.weights * along))
    u = max(_u(best) + move, 1 / FINEST**2)
    return round(float(np.sqrt(1 / u)))
