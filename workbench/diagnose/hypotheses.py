"""What is compared: the base, and models with one or two causes, each fitted to all runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.solve import CLUTTER, Fit

__all__ = ["Hypothesis", "Refits", "doubt_of", "judged", "left_together", "more_than_a_little"]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A model with some causes, refitted to all runs.

    Args:
        causes: their names; none is the base.
        fit: where it ended.
        cost: with the clutter of all other causes; what hypotheses are compared by.
        size: root mean square of what the causes explain, in noise deviations.
        left: root mean square of what is left and hangs together in time, in noise deviations.
        beyond: the same of what the clutter of all causes does not explain either.
        near: all causes around the fit.
    """

    causes: tuple[str, ...]
    fit: Fit
    cost: float
    size: float
    left: float
    beyond: float
    near: Neighbourhood


@dataclass(frozen=True, eq=False)
class Refits:
    """All that were refitted.

    Args:
        base: without causes.
        singles: with one cause, best first.
        pairs: with two, best first.
        scores: of every single cause, from the neighbourhood of the base.
        threshold: worth that noise alone reaches once in a hundred times.
        doubt: standard error of the square of what is left and hangs together.
    """

    base: Hypothesis
    singles: tuple[Hypothesis, ...]
    pairs: tuple[Hypothesis, ...]
    scores: tuple[Score, ...]
    threshold: float
    doubt: float

    def with_as_many(self, causes: int) -> tuple[Hypothesis, ...]:
        """Return the singles or the pairs, best first."""
        return self.singles if causes == 1 else self.pairs

    def suspicious(self, left: float) -> bool:
        """Tell whether noise deviations that are left are more than a little of every cause is."""
        return more_than_a_little(self.base, left, self.doubt)

    def worth(self, hypothesis: Hypothesis) -> float:
        """Return how much cheaper it is than the base with its clutter."""
        return self.base.cost - hypothesis.cost


def judged(problem: Problem, causes: tuple[str, ...], found: Fit, base: Fit | None) -> Hypothesis:
    """Return what a fit with some causes came to.

    Args:
        problem: that was fitted.
        causes: that were released.
        found: the fit, with the columns of all causes around it.
        base: that of the base; None where this is it.
    """
    samples = problem.samples()
    near = Neighbourhood(problem.layout, found.linear, samples)
    size = 0.0 if base is None else found.apart(base, samples)
    left = left_together(problem, problem.runs, found.residuals)
    beyond = left_together(problem, problem.runs, near.unexplained(causes))
    return Hypothesis(causes, found, near.lowest(causes), size, left, beyond, near)


def more_than_a_little(base: Hypothesis, left: float, doubt: float) -> bool:
    """Tell whether noise deviations that are left are more than a little of every cause makes."""
    return left**2 > len(base.near.heard) * CLUTTER**2 + doubt


def doubt_of(problem: Problem) -> float:
    """Return how far chance, and a memory known from few samples at rest, move what is left."""
    rest = sum(len(run.rest) for run in problem.rig.runs)
    return float(np.sqrt(1 / problem.samples() + 1 / max(rest, 1)))


def left_together(
    problem: Problem, runs: Sequence[int], residuals: Sequence[NDArray[np.float64]]
) -> float:
    """Return what is left and hangs together: the root of the covariance of neighbouring samples.

    Noise that was whitened adds nothing to it; what the model misses lasts longer than a sample.

    Args:
        problem: with what was seen.
        runs: that count.
        residuals: of each of those, (m_k,) whitened.
    """
    total, count = 0.0, 0
    for k, residual in zip(runs, residuals, strict=True):
        seen = problem.seen[k]
        seen = seen[: len(residual) // seen.shape[1]]
        rows = np.where(seen, residual.reshape(seen.shape), 0.0)
        total += float(np.sum(rows[1:] * rows[:-1]))
        count += int((seen[1:] & seen[:-1]).sum())
    return float(np.sqrt(max(total / max(count, 1), 0.0)))
