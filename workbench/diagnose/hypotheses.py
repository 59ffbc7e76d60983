"""Refits of the true problem: the base alone, then with one or two causes released."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.problem import Linear, Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.solve import Fit, Prior, fit, prior_of, renewed
from workbench.progress import Progress, counted

__all__ = ["Hypothesis", "Refits", "left_together", "refit_all"]


_WINDOWS_S = (1.0, 2.5, 5.0)
"""How much of each run the first fits see: a lightly damped beam forgets nothing, and a fit of
whole runs that starts far off falls into a wrong valley."""
_ROUGH = 1.0  # of the cost: enough for a fit that only leads to the next
_SINGLES = 8
_ADDED, _OTHERS = 4, 4  # pairs with the best single cause, and without it
_EXPLAINED = 0.2  # noise deviations: what is left of less needs no other pair
_BEHIND = 0.5  # share of the best worth below which no refit is tried
_POOR = 0.4  # noise deviations, and share of what the base leaves: a refit that led nowhere
_FAR = 1.0  # noise deviations that the base leaves: the minimum lies in no neighbourhood of it
_RETRIES = 3  # fits in growing windows are dear
_ROUNDS = 8
_REFIT_ROUNDS = 5
_FAR_ROUNDS = 2  # of a base that cannot follow the runs anyway
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

    def worth(self, hypothesis: Hypothesis) -> float:
        """Return how much cheaper it is than the base with its clutter."""
        return self.base.cost - hypothesis.cost


def refit_all(problem: Problem, tell: Progress = lambda text: None, seed: int = 0) -> Refits:
    """Fit the base, score all causes, refit the promising ones and pairs of them."""
    tell("fit the base within its tolerances")
    base = _base(problem)
    scores = base.near.scores()
    best = max(scores[0].worth, 0.0) if scores else 0.0
    chosen = [s for s in scores[:_SINGLES] if s.worth > max(_BEHIND * best, _MORE)]
    search = _Search(problem, base)
    for k, score in enumerate(chosen):
        tell(counted(f"refit with {score.causes[0]}", k + 1, len(chosen)))
        search.refit(score)
    couples = _promising(base.near, search.found(1))
    for k, score in enumerate(couples):
        tell(counted(f"refit with {' and '.join(score.causes)}", k + 1, len(couples)))
        search.refit(score)
    search.simplify()
    singles, pairs = search.found(1), search.found(2)
    threshold = base.near.threshold(seed)
    return Refits(base, singles, pairs, tuple(scores), threshold, _doubt(problem))


class _Search:
    """The hypotheses that were refitted so far, the best fit of each."""

    def __init__(self, problem: Problem, base: Hypothesis) -> None:
        self.problem, self.base = problem, base
        self.best: dict[tuple[str, ...], Hypothesis] = {}
        self.retries = 0

    def found(self, count: int) -> tuple[Hypothesis, ...]:
        """Return those with so many causes, best first."""
        same = [one for one in self.best.values() if len(one.causes) == count]
        return tuple(sorted(same, key=lambda one: one.cost))

    def refit(self, score: Score) -> None:
        """Fit from where the neighbourhood of the base expects the minimum.

        Where that leads nowhere, or the misfit is too large for a neighbourhood, the windows grow
        once more, the causes released from the first second on.
        """
        far = self.base.left > _FAR
        if not far or self.retries == _RETRIES:
            first = self._fit(score.causes, score.z, self.base.fit.linear)
            far = first.left > max(_POOR, _POOR * self.base.left)
        if far and self.retries < _RETRIES:
            self.retries += 1
            prior = prior_of(self.problem.layout, score.causes)
            self._fit(score.causes, _in_windows(self.problem, prior), None)

    def simplify(self) -> None:
        """Fit each half of the best pair alone, from where the pair's fit ended."""
        pairs, singles = self.found(2), self.found(1)
        if not pairs or (singles and pairs[0].cost > singles[0].cost - _MORE):
            return
        for name in pairs[0].causes:
            self._fit((name,), pairs[0].fit.z, None)

    def _fit(
        self, causes: tuple[str, ...], z: NDArray[np.float64], linear: Linear | None
    ) -> Hypothesis:
        layout = self.problem.layout
        quantities = layout.quantities(causes)
        begin = z.copy()
        begin[np.setdiff1d(layout.quantities(tuple(layout.of_cause)), quantities)] = 0.0
        if linear is not None:
            begin[layout.own()] = self.base.fit.z[layout.own()]
        prior = prior_of(layout, causes)
        near = linear or renewed(self.problem, begin, prior.free, np.inf, self.base.fit.linear)
        refresh = quantities if linear is not None else prior.free
        found = fit(self.problem, begin, prior, linear=near, refresh=refresh, rounds=_REFIT_ROUNDS)
        judged = _judged(self.problem, causes, found, self.base.fit)
        if causes not in self.best or judged.cost < self.best[causes].cost:
            self.best[causes] = judged
        return judged


def _base(problem: Problem) -> Hypothesis:
    layout = problem.layout
    prior = prior_of(layout)
    z, rounds = np.zeros(len(layout)), _ROUNDS
    for until in _windows(problem):
        found = fit(problem, z, prior, until, enough=_ROUGH)
        z = found.z
        problem.look_again(z)
        twice = found.cost > problem.samples(until)  # what noise leaves
        rounds = _FAR_ROUNDS if twice else _ROUNDS
    linear = problem.linear(z, np.arange(len(layout)))
    found = fit(problem, z, prior, linear=linear, refresh=prior.free, rounds=rounds)
    return _judged(problem, (), found, None)


def _in_windows(problem: Problem, prior: Prior) -> NDArray[np.float64]:
    """Return where fits of ever more of each run lead, from what is stated."""
    z = np.zeros(len(problem.layout))
    for until in _windows(problem):
        z = fit(problem, z, prior, until, enough=_ROUGH).z
    return z


def _windows(problem: Problem) -> list[float]:
    longest = max(float(problem.rig.runs[k].times[-1]) for k in problem.runs)
    return [window for window in _WINDOWS_S if window < longest]


def _promising(near: Neighbourhood, singles: Sequence[Hypothesis]) -> list[Score]:
    """Return pairs that are worth a refit.

    First those that add to the best single cause, seen from its own fit; then those of two others
    that promise more from the base than it reached, for there may be pairs of which no half helps.
    """
    if not singles:
        return []
    best = singles[0]
    own = best.near
    added = [own.score((*best.causes, name)) for name in own.heard if name not in best.causes]
    found = [one for one in added if best.cost - one.cost > _MORE]
    found = sorted(found, key=lambda one: one.cost)[:_ADDED]
    if best.beyond < _EXPLAINED:
        return found
    pairs = [pair for pair in combinations(near.heard, 2) if best.causes[0] not in pair]
    others = [one for one in map(near.score, pairs) if best.cost - one.cost > _MORE]
    return [*found, *sorted(others, key=lambda one: one.cost)[:_OTHERS]]


def _judged(problem: Problem, causes: tuple[str, ...], found: Fit, base: Fit | None) -> Hypothesis:
    samples = problem.samples()
    near = Neighbourhood(problem.layout, found.linear, samples)
    size = 0.0 if base is None else found.apart(base, samples)
    left = left_together(problem, problem.runs, found.residuals)
    beyond = left_together(problem, problem.runs, near.unexplained(causes))
    return Hypothesis(causes, found, near.lowest(causes), size, left, beyond, near)


def _doubt(problem: Problem) -> float:
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
        rows = np.where(seen, residual.reshape(seen.shape), 0.0)
        total += float(np.sum(rows[1:] * rows[:-1]))
        count += int((seen[1:] & seen[:-1]).sum())
    return float(np.sqrt(max(total / max(count, 1), 0.0)))
