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

__all__ = ["DEARER", "Hypothesis", "contradiction", "judged", "left_together", "with_clutter"]

DEARER = 2.0
"""Of the cost, than with a cause fewer: clutter was not fitted to the end."""
_FORETOLD = 30.0  # of the cost: clutter that is said to gain more is tried
_TRIALS = 24
_ENOUGH, _ROUGH = 1.0, 0.005  # of the cost, and of its excess over noise: less ends them


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
    problem: Problem, causes: tuple[str, ...], found: Fit, fewer: Sequence[Hypothesis] = ()
) -> Hypothesis:
    """Return a fit as a hypothesis.

    Args:
        problem: that was fitted.
        causes: released in it.
        found: where it ended.
        fewer: hypotheses with some of the causes, that of the base first; none where this is it.
    """
    samples = problem.samples()
    near = with_clutter(problem, causes, found, samples, fewer)
    size = found.apart(fewer[0].fit, samples) if fewer else 0.0
    left = left_together(problem, problem.runs, found.residuals)
    beyond = left_together(problem, problem.runs, near.unexplained(causes))
    return Hypothesis(causes, found, near.lowest(causes), size, left, beyond, near)


def with_clutter(
    problem: Problem,
    causes: tuple[str, ...],
    found: Fit,
    samples: int,
    fewer: Sequence[Hypothesis] = (),
) -> Neighbourhood:
    """Return all causes around a fit, or around the place that their clutter really leads to.

    What clutter gains is foretold well where it is little. In hops, straight lines let it gain
    more than what tells two causes apart: there it is tried, all but that of causes that are dear
    to simulate, for it is small. Where the clutter of fewer causes led is a place for more of them
    as well. They begin there if that is cheaper than their own fit, and also where they ended
    dearer than those fewer: a cause more can make nothing dearer.

    Args:
        problem: that was fitted.
        causes: released in it.
        found: where it ended.
        samples: compared.
        fewer: hypotheses with some of the causes.
    """
    near = Neighbourhood(problem.layout, found.linear, samples)
    best = min(fewer, key=lambda one: one.cost, default=None)
    if best is not None and _cost_from(best, near, causes) < near.lowest(causes):
        return _led(problem, causes, near, best)
    tried = near
    if found.cost - near.lowest(causes) >= _FORETOLD:
        tried = _led(problem, causes, near)
    if best is None or tried.lowest(causes) <= best.cost + DEARER:
        return tried
    return min(tried, _led(problem, causes, near, best), key=lambda one: one.lowest(causes))


def _cost_from(best: Hypothesis, near: Neighbourhood, causes: tuple[str, ...]) -> float:
    """Return the cost where the clutter of fewer causes led."""
    prior = prior_of(near.layout, causes, _tried(near))
    return best.near.cost + prior.cost(best.near.z)


def _led(
    problem: Problem,
    causes: tuple[str, ...],
    near: Neighbourhood,
    best: Hypothesis | None = None,
) -> Neighbourhood:
    """Return all causes around where their clutter leads, from a fit or from that of fewer."""
    layout, linear, refresh = problem.layout, near.linear, problem.layout.base
    if best is not None:
        place = layout.taken_over(best.near.z, causes)
        refresh = np.union1d(refresh, layout.quantities(causes))
        linear = renewed(problem, place, refresh, np.inf, best.near.linear)
    prior = prior_of(layout, causes, _tried(near))
    led = fit(problem, linear.z, prior, linear=linear, refresh=refresh, enough=_ENOUGH,
              rough=_ROUGH, trials=_TRIALS, settle=False)  # fmt: skip
    return Neighbourhood(layout, led.linear, near.samples)


def _tried(near: Neighbourhood) -> NDArray[np.float64]:
    """Return the clutter (u,) that is simulated."""
    clutter = near.clutter.copy()
    clutter[near.layout.quantities(near.layout.dear)] = 0.0
    return clutter


def contradiction(one: Hypothesis, fewer: Sequence[Hypothesis]) -> float:
    """Return by how much a hypothesis is dearer than one of fewer causes, zero where it is not.

    A cause more can make nothing dearer, for clutter may do without it. Where its fit is cheaper
    and yet, with its clutter, dearer, clutter was not fitted to the end.
    """
    dearer = [one.cost - less.cost for less in fewer if one.fit.cost <= less.fit.cost]
    return max((0.0, *dearer))


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
