"""What a fit is worth as a hypothesis, with the clutter of all causes that it does not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.minimum import prior_of
from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood
from workbench.diagnose.solve import Fit, fit, renewed

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


def judged(
    problem: Problem, causes: tuple[str, ...], found: Fit, base: Hypothesis | None
) -> Hypothesis:
    """Return a fit as a hypothesis.

    Args:
        problem: that was fitted.
        causes: released in it.
        found: where it ended.
        base: without causes; None where this is it.
    """
    samples = problem.samples()
    near = with_clutter(problem, causes, found, samples, base.near if base else None)
    size = 0.0 if base is None else found.apart(base.fit, samples)
    left = left_together(problem, problem.runs, found.residuals)
    beyond = left_together(problem, problem.runs, near.unexplained(causes))
    return Hypothesis(causes, found, near.lowest(causes), size, left, beyond, near)


def with_clutter(
    problem: Problem,
    causes: tuple[str, ...],
    found: Fit,
    samples: int,
    base: Neighbourhood | None = None,
) -> Neighbourhood:
    """Return all causes around a fit, or around the place that their clutter really leads to.

    What clutter gains is foretold well where it is little. In hops, straight lines let it gain
    more than what tells two causes apart: there it is tried, all but that of the numerics, which
    is small and dear to simulate. Where the clutter of the base led is a place for every cause as
    well, and they begin there if that is cheaper than their own fit.
    """
    layout = problem.layout
    near = Neighbourhood(layout, found.linear, samples)
    clutter = near.clutter.copy()
    clutter[layout.quantities(layout.numerics)] = 0.0
    prior, linear, refresh = prior_of(layout, causes, clutter), found.linear, layout.base
    if base is not None and base.cost + prior.cost(base.z) < near.lowest(causes):
        place = layout.taken_over(base.z, causes)
        refresh = np.union1d(refresh, layout.quantities(causes))
        linear = renewed(problem, place, refresh, np.inf, base.linear)
    elif found.cost - near.lowest(causes) < _FORETOLD:
        return near
    led = fit(problem, linear.z, prior, linear=linear, refresh=refresh, enough=_ENOUGH,
              rough=0.0, trials=_TRIALS, settle=False)  # fmt: skip
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
