"""What a fit is worth as a hypothesis, with the clutter of all causes that it does not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood
from workbench.diagnose.solve import Fit, fit, prior_of

__all__ = ["Hypothesis", "judged", "left_together", "with_clutter"]

_FORETOLD = 200.0  # of the cost: clutter that is said to gain more is tried
_TRIALS = 8
_ENOUGH = 4.0  # of the cost: a trial that gains less ends them


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
        near: all causes around the fit, or around where their clutter leads it.
    """

    causes: tuple[str, ...]
    fit: Fit
    cost: float
    size: float
    left: float
    beyond: float
    near: Neighbourhood


def judged(problem: Problem, causes: tuple[str, ...], found: Fit, base: Fit | None) -> Hypothesis:
    """Return a fit as a hypothesis.

    Args:
        problem: that was fitted.
        causes: released in it.
        found: where it ended.
        base: the fit without causes; None where this is it.
    """
    samples = problem.samples()
    near = with_clutter(problem, causes, found, samples)
    size = 0.0 if base is None else found.apart(base, samples)
    left = left_together(problem, problem.runs, found.residuals)
    beyond = left_together(problem, problem.runs, near.unexplained(causes))
    return Hypothesis(causes, found, near.lowest(causes), size, left, beyond, near)


def with_clutter(
    problem: Problem, causes: tuple[str, ...], found: Fit, samples: int
) -> Neighbourhood:
    """Return all causes around a fit, or around the place that their clutter really leads to.

    What clutter gains is foretold well where it is little. In hops, straight lines let it gain
    more than what tells two causes apart: there it is tried, all but that of the numerics, which
    is small and dear to simulate.
    """
    layout = problem.layout
    near = Neighbourhood(layout, found.linear, samples)
    if found.cost - near.lowest(causes) < _FORETOLD:
        return near
    clutter = near.clutter.copy()
    clutter[layout.quantities(layout.numerics)] = 0.0
    prior = prior_of(layout, causes, clutter)
    led = fit(problem, found.z, prior, linear=found.linear, refresh=layout.base,
              enough=_ENOUGH, rough=0.0, trials=_TRIALS, settle=False)  # fmt: skip
    return Neighbourhood(layout, led.linear, samples)


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
