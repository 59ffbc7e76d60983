"""Refits of the true problem: the base alone, then with one or two causes released."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.solve import ENOUGH, Fit, fit, prior_of

__all__ = ["Hypothesis", "Refits", "refit_all"]

Tell = Callable[[str], None]

_WINDOWS_S = (1.0, 2.5, 5.0)
"""How much of each run the first fits see: a lightly damped beam forgets nothing, and a fit of
whole runs that starts far off falls into a wrong valley."""
_ROUGH = 1.0  # of the cost: enough for a fit that only leads to the next
_SINGLES, _PAIRS = 8, 8
_BEHIND = 0.5  # share of the best worth below which no refit is tried
_MORE = 4.0  # of worth that a pair must promise beyond its better half


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A model with some causes, refitted to all runs.

    Args:
        causes: their names; none is the base.
        fit: where it ended.
        cost: with the clutter of all other causes; what hypotheses are compared by.
        size: root mean square of what the causes explain, in noise deviations.
        left: root mean square of what is left and hangs together in time, in noise deviations.
        near: all causes around the fit.
    """

    causes: tuple[str, ...]
    fit: Fit
    cost: float
    size: float
    left: float
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
    """

    base: Hypothesis
    singles: tuple[Hypothesis, ...]
    pairs: tuple[Hypothesis, ...]
    scores: tuple[Score, ...]
    threshold: float

    def worth(self, hypothesis: Hypothesis) -> float:
        """Return how much cheaper it is than the base with its clutter."""
        return self.base.cost - hypothesis.cost


def refit_all(problem: Problem, tell: Tell = lambda text: None, seed: int = 0) -> Refits:
    """Fit the base, score all causes, refit the promising ones and pairs of them."""
    tell("fit the base within its tolerances")
    base = _base(problem)
    scores = base.near.scores()
    best = max(scores[0].worth, 0.0) if scores else 0.0
    chosen = [s for s in scores[:_SINGLES] if s.worth > max(_BEHIND * best, _MORE)]
    singles = []
    for k, score in enumerate(chosen):
        tell(f"refit with {score.causes[0]} ({k + 1} of {len(chosen)})")
        singles.append(_refitted(problem, base, score))
    pairs = []
    couples = _promising(base.near, scores) if chosen else []
    for k, score in enumerate(couples):
        tell(f"refit with {' and '.join(score.causes)} ({k + 1} of {len(couples)})")
        pairs.append(_refitted(problem, base, score))
    order = sorted(singles, key=lambda h: h.cost), sorted(pairs, key=lambda h: h.cost)
    return Refits(base, tuple(order[0]), tuple(order[1]), tuple(scores), base.near.threshold(seed))


def _base(problem: Problem) -> Hypothesis:
    layout = problem.layout
    prior, z = prior_of(layout), np.zeros(len(layout))
    longest = max(float(problem.rig.runs[k].times[-1]) for k in problem.runs)
    for until in (w for w in _WINDOWS_S if w < longest):
        z = fit(problem, z, prior, until, enough=_ROUGH).z
    linear = problem.linear(z, np.arange(len(layout)))
    found = fit(problem, z, prior, linear=linear, refresh=prior.free)
    return _judged(problem, (), found, None)


def _promising(near: Neighbourhood, scores: Sequence[Score]) -> list[Score]:
    """Return the pairs that promise more than their better half alone."""
    alone = {score.causes[0]: score.worth for score in scores}
    found = []
    for pair in combinations(near.heard, 2):
        score = near.score(pair)
        if score.worth > max(alone[name] for name in pair) + _MORE:
            found.append(score)
    found.sort(key=lambda score: -score.worth)
    best = found[0].worth if found else 0.0
    return [score for score in found[:_PAIRS] if score.worth > _BEHIND * best]


def _refitted(problem: Problem, base: Hypothesis, score: Score) -> Hypothesis:
    layout = problem.layout
    quantities = layout.quantities(score.causes)
    z = score.z.copy()
    others = np.setdiff1d(layout.quantities(tuple(layout.of_cause)), quantities)
    z[others] = 0.0
    z[layout.own()] = base.fit.z[layout.own()]
    prior = prior_of(layout, score.causes)
    found = fit(
        problem, z, prior, linear=base.fit.linear, refresh=quantities, enough=ENOUGH, rounds=5
    )
    return _judged(problem, score.causes, found, base.fit)


def _judged(problem: Problem, causes: tuple[str, ...], found: Fit, base: Fit | None) -> Hypothesis:
    samples = problem.samples()
    near = Neighbourhood(problem.layout, found.z, found.linear, samples)
    size = 0.0
    if base is not None:
        pairs = zip(found.residuals, base.residuals, strict=True)
        size = float(np.sqrt(sum(float(np.sum((a - b) ** 2)) for a, b in pairs) / samples))
    return Hypothesis(causes, found, near.lowest(causes), size, _left(problem, found), near)


def _left(problem: Problem, found: Fit) -> float:
    """Return what is left and hangs together: the root of the covariance of neighbouring samples.

    Noise that was whitened adds nothing to it; what the model misses lasts longer than a sample.
    """
    total, count = 0.0, 0
    for k, residual in zip(problem.runs, found.residuals, strict=True):
        channels = len(problem.rig.runs[k].channels)
        rows: NDArray[np.float64] = residual.reshape(-1, channels)
        both = (rows[1:] != 0) & (rows[:-1] != 0)  # a sample that was not seen has residual zero
        total += float(np.sum((rows[1:] * rows[:-1])[both]))
        count += int(both.sum())
    return float(np.sqrt(max(total / max(count, 1), 0.0)))
