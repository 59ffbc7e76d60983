"""Refits of the true problem: the base alone, then with one or two causes released."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.judging import Hypothesis, judged, left_together
from workbench.diagnose.minimum import Prior, prior_of
from workbench.diagnose.problem import Linear, Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.solve import TRIALS, Fit, fit, renewed
from workbench.progress import Progress, counted

__all__ = ["SURE", "Refits", "refit_all"]

SURE = 3.0
"""Standard errors: what is that far off is no chance."""

_WINDOWS_S = (1.0, 2.5, 5.0)
"""How much of each run the first fits see: a lightly damped beam forgets nothing, and a fit of
whole runs that starts far off falls into a wrong valley."""
_ROUGH, _LEADING = 1.0, 0.1
"""Of the cost, and of its excess over noise: enough for a fit that only leads to the next."""
_SINGLES = 8
_ADDED, _OTHERS = 4, 4  # pairs with the best single cause, and without it
_EXPLAINED = 0.2  # noise deviations: what is left of less needs no other pair
_BEHIND = 0.5  # share of the best worth below which no refit is tried
_POOR = 0.4  # noise deviations, and share of what the base leaves: a refit that led nowhere
_FAR = 1.0  # noise deviations that a fit leaves: the minimum lies in no neighbourhood of it
_FAR_BEHIND = 0.1  # share of the best worth, seen in a part of the runs only
_RACING = 3  # times the excess cost of the best: what is dearer leaves the race
_ARRIVING = 2  # of a race, fitted to whole runs
_GOING_ON = 3  # where trials were used up
_SURPRISING = 2.0  # times what was promised: the base may have stopped on its way, not the cause
_KEPT = 0.5  # share of what was promised below which a neighbourhood has misled
_RETRIES = 3  # fits in growing windows are dear
_REFIT_TRIALS = 12
_FAR_TRIALS = 8  # of a base that cannot follow the runs anyway
_LIKELY = 5.0  # of worth: what is less far behind the best may be the truth
_LITTLE = 0.5  # of worth: what promises less is not the truth
_MORE = 4.0  # of worth that a pair must promise beyond its better half


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

    @property
    def far(self) -> bool:
        """Tell whether the base misses the runs by more than any mixture of little causes."""
        return self.base.left > _FAR

    def suspicious(self, left: float) -> bool:
        """Tell whether noise deviations that are left are more than a little of every cause is."""
        return _suspicious(self.base, left, self.doubt)

    def worth(self, hypothesis: Hypothesis) -> float:
        """Return how much cheaper it is than the base with its clutter."""
        return self.base.cost - hypothesis.cost


def refit_all(problem: Problem, tell: Progress = lambda text: None, seed: int = 0) -> Refits:
    """Fit the base, score all causes, refit the promising ones and pairs of them.

    Causes are scored where the base follows the runs: at their ends, or, where it leaves too much
    there for any neighbourhood to reach the truth, in the longest window that it still follows. A
    second cause is sought where one leaves more than a little of every cause makes.
    """
    tell("fit the base within its tolerances")
    base, close = _base(problem)
    search = _Search(problem, base, tell)
    scores = close.scores()
    doubt = _doubt(problem)
    something = search.far or _suspicious(base, base.left, doubt)
    chosen = _worthy(scores, search.far, something)
    if search.far:
        search.race(chosen)
    else:
        search.refit(chosen, _worthy(scores, True, something))
    search.arrive(1)
    search.doubt_base(scores)
    base = search.base
    for best in search.found(1)[:1]:
        if search.far and best.left > _FAR:
            search.race(_beside(close, best.causes[0]))
        elif _suspicious(base, best.left, doubt):
            search.refit(_adding(best) if search.far else _promising(close, best))
    search.arrive(2)
    search.simplify()
    singles, pairs = search.found(1), search.found(2)
    threshold = base.near.threshold(seed)
    return Refits(base, singles, pairs, tuple(scores), threshold, doubt)


class _Search:
    """The hypotheses that were refitted so far, the best fit of each."""

    def __init__(self, problem: Problem, base: Hypothesis, tell: Progress) -> None:
        self.problem, self.base, self.tell = problem, base, tell
        self.best: dict[tuple[str, ...], Hypothesis] = {}
        self.retries = _RETRIES

    @property
    def far(self) -> bool:
        """Tell whether the minimum lies in no neighbourhood of the base."""
        return self.base.left > _FAR

    def found(self, count: int) -> tuple[Hypothesis, ...]:
        """Return those with so many causes, best first."""
        same = [one for one in self.best.values() if len(one.causes) == count]
        return tuple(sorted(same, key=lambda one: one.cost))

    def refit(self, scores: Sequence[Score], rivals: Sequence[Score] = ()) -> None:
        """Fit each; race those that their neighbourhood misled.

        What promised less than another has reached needs no race.

        Args:
            scores: that are fitted.
            rivals: that race as well: where a neighbourhood misled, its word against others is
                worth as little.
        """
        misled = []
        for k, score in enumerate(scores):
            self.tell(counted(f"refit with {' and '.join(score.causes)}", k + 1, len(scores)))
            found = self._refit(score.causes)
            short = self.base.cost - found.cost < _KEPT * (self.base.cost - score.cost)
            short = short and score.worth > _MORE
            if short and found.left > max(_POOR, _POOR * self.base.left):
                misled.append(score)
        reached = min((one.cost for one in self.best.values()), default=np.inf)
        again = [score for score in misled if score.cost < reached][: self.retries]
        if again and not self.far:
            self.race([*again, *(one for one in rivals if one not in again)])
            self.retries -= len(again)

    def race(self, scores: Sequence[Score]) -> None:
        """Fit in growing windows, the causes released from the first second on.

        What is far behind in a window does not enter the next.
        """
        layout = self.problem.layout
        running = {score.causes: (np.zeros(len(layout)), 0.0) for score in scores}
        for until in _windows(self.problem):
            excess = {}
            for k, (causes, (z, damping)) in enumerate(running.items()):
                words = f"fit {until:g} s with {' and '.join(causes)}"
                self.tell(counted(words, k + 1, len(running)))
                prior = prior_of(layout, causes)
                found = _leading(self.problem, z, prior, until, damping)
                running[causes] = found.z, found.damping
                excess[causes] = max(found.cost - self.problem.samples(until) / 2, _MORE)
            most = _RACING * min(excess.values(), default=0.0)
            running = {causes: running[causes] for causes in sorted(excess, key=excess.__getitem__)
                       if excess[causes] <= most}  # fmt: skip
        for k, causes in enumerate(list(running)[:_ARRIVING]):
            words = f"refit with {' and '.join(causes)}"
            self.tell(counted(words, k + 1, min(len(running), _ARRIVING)))
            self._fit_anew(causes, *running[causes])

    def arrive(self, count: int) -> None:
        """Go on with those that explain about the most, where their trials were used up.

        One that stopped on its way may be the truth, and fall to a rival that arrived.
        """
        found = sorted(self.found(count), key=lambda one: one.fit.cost)
        most = max((self._gained(one) for one in found), default=0.0)
        near = [one for one in found if self._gained(one) >= _BEHIND * most]
        for one in [one for one in near if not one.fit.arrived][:_GOING_ON]:
            self.tell(f"go on with {' and '.join(one.causes)}")
            self._fit_anew(one.causes, one.fit.z, one.fit.damping)

    def _gained(self, one: Hypothesis) -> float:
        return self.base.fit.cost - one.fit.cost

    def doubt_base(self, scores: Sequence[Score]) -> None:
        """Fit the base again from where the best cause ended, if that gained more than promised.

        Valleys of hops are long: what a refit gains may come of the base numbers alone, which went
        on where the base had stopped.
        """
        promised = {score.causes: score.worth for score in scores}
        for best in self.found(1)[:1]:
            worth = self.base.cost - best.cost
            if self.far or worth < _SURPRISING * promised.get(best.causes, 0.0) + _MORE:
                continue
            self.tell(f"fit the base again, from where {best.causes[0]} led")
            self._fit_base_anew(best)

    def _fit_base_anew(self, best: Hypothesis) -> None:
        layout = self.problem.layout
        prior, begin = prior_of(layout), self._without_others(best.fit.z, ())
        replaced = layout.replaced(best.causes)  # as stated there, beside the cause
        begin[replaced] = self.base.fit.z[replaced]
        near = renewed(self.problem, begin, prior.free, np.inf, self.base.fit.linear)
        found = fit(self.problem, begin, prior, linear=near, trials=_REFIT_TRIALS)
        base = judged(self.problem, (), found, None)
        if base.cost < self.base.cost:
            self.base = base
            self.best = {
                causes: replace(one, size=one.fit.apart(found, one.near.samples))
                for causes, one in self.best.items()
            }

    def simplify(self) -> None:
        """Fit each half of the best pair alone, from where the pair's fit ended."""
        pairs, singles = self.found(2), self.found(1)
        if not pairs or (singles and pairs[0].cost > singles[0].cost - _MORE):
            return
        for name in pairs[0].causes:
            self._fit_anew((name,), pairs[0].fit.z)

    def _refit(self, causes: tuple[str, ...]) -> Hypothesis:
        """Fit from the best that was found with fewer of the causes: it should not end dearer."""
        layout, origin = self.problem.layout, self._within(causes)
        fresh = tuple(name for name in causes if name not in origin.causes)
        place, linear = layout.taken_over(origin.fit.z, fresh), origin.fit.linear
        if origin is not self.base:
            linear = renewed(self.problem, place, layout.quantities(fresh), np.inf, linear)
        return self._fit(causes, place, linear, layout.quantities(causes))

    def _within(self, causes: tuple[str, ...]) -> Hypothesis:
        fewer = [one for one in self.best.values() if set(one.causes) < set(causes)]
        return min((self.base, *fewer), key=lambda one: one.fit.cost)

    def _fit_anew(
        self, causes: tuple[str, ...], z: NDArray[np.float64], damping: float = 0.0
    ) -> Hypothesis:
        """Fit from a place where no derivatives were taken yet."""
        free, begin = prior_of(self.problem.layout, causes).free, self._without_others(z, causes)
        near = renewed(self.problem, begin, free, np.inf, self.base.fit.linear)
        return self._fit(causes, begin, near, free, damping)

    def _without_others(
        self, z: NDArray[np.float64], causes: tuple[str, ...]
    ) -> NDArray[np.float64]:
        """Return a place (u,) with the quantities of all other causes at zero."""
        layout, there = self.problem.layout, z.copy()
        every, own = layout.quantities(tuple(layout.of_cause)), layout.quantities(causes)
        there[np.setdiff1d(every, own)] = 0.0
        return there

    def _fit(
        self,
        causes: tuple[str, ...],
        z: NDArray[np.float64],
        linear: Linear,
        refresh: NDArray[np.int_],
        damping: float = 0.0,
    ) -> Hypothesis:
        prior = prior_of(self.problem.layout, causes)
        found = fit(self.problem, z, prior, linear=linear, refresh=refresh, trials=_REFIT_TRIALS,
                    damping=damping)  # fmt: skip
        hypothesis = judged(self.problem, causes, found, self.base)
        if causes not in self.best or hypothesis.cost < self.best[causes].cost:
            self.best[causes] = hypothesis
        return hypothesis


def _base(problem: Problem) -> tuple[Hypothesis, Neighbourhood]:
    """Return the base, and all causes around its fit of the longest window that it follows."""
    layout = problem.layout
    prior, every = prior_of(layout), np.arange(len(layout))
    z, trials, follows, damping = np.zeros(len(layout)), TRIALS, True, 0.0
    place, window = z, np.inf
    for until in _windows(problem):
        found = _leading(problem, z, prior, until, damping)
        z, damping = found.z, found.damping
        follows = follows and left_together(problem, problem.runs, found.residuals) < _FAR
        if follows or window == np.inf:
            place, window = z, until
        problem.look_again(z)
        twice = found.cost > problem.samples(until)  # what noise leaves
        trials = _FAR_TRIALS if twice else TRIALS
    first = fit(problem, z, prior, trials=trials, settle=False, damping=damping)
    z = first.z
    linear = problem.linear(z, every)
    found = fit(problem, z, prior, linear=linear, trials=trials, settle=False,
                damping=first.damping)  # fmt: skip
    base = judged(problem, (), found, None)
    if base.left <= _FAR or window == np.inf:
        return base, base.near
    close = problem.linear(place, every, window)
    return base, Neighbourhood(layout, close, problem.samples(window))


def _leading(
    problem: Problem, z: NDArray[np.float64], prior: Prior, until: float, damping: float
) -> Fit:
    """Return a fit of the first seconds that only leads to a longer window, or out of a race."""
    return fit(problem, z, prior, until, enough=_ROUGH, rough=_LEADING, settle=False,
               damping=damping)  # fmt: skip


def _windows(problem: Problem) -> list[float]:
    longest = max(float(problem.rig.runs[k].times[-1]) for k in problem.runs)
    return [window for window in _WINDOWS_S if window < longest]


def _worthy(scores: Sequence[Score], far: bool, something: bool) -> list[Score]:
    """Return the scores that are worth a refit: a share of the best, or near it.

    Args:
        scores: best first.
        far: whether the base cannot follow the runs.
        something: whether something must be there, however little each cause promises.
    """
    best = max((score.worth for score in scores), default=0.0)
    if best < _MORE and not something:
        return []
    share = (_FAR_BEHIND if far else _BEHIND) * best
    least = share if far else max(min(share, best - _LIKELY), _LITTLE)
    return [score for score in scores[:_SINGLES] if score.worth > least]


def _beside(near: Neighbourhood, cause: str) -> list[Score]:
    """Return the pairs of a cause that a neighbourhood promises most of."""
    pairs = [near.score((cause, name)) for name in near.heard if name != cause]
    return sorted(pairs, key=lambda one: one.cost)[:_ADDED]


def _promising(near: Neighbourhood, best: Hypothesis) -> list[Score]:
    """Return pairs that are worth a refit.

    First those that add to the best single cause, seen from its own fit; then those of two others
    that promise more from the base than it reached, for there may be pairs of which no half helps.
    """
    found = _adding(best)
    if best.beyond < _EXPLAINED:
        return found
    pairs = [pair for pair in combinations(near.heard, 2) if best.causes[0] not in pair]
    others = [one for one in map(near.score, pairs) if best.cost - one.cost > _MORE]
    return [*found, *sorted(others, key=lambda one: one.cost)[:_OTHERS]]


def _adding(best: Hypothesis) -> list[Score]:
    """Return pairs of a cause and another that promises more, seen from the fit of the first."""
    near = best.near
    added = [near.score((*best.causes, name)) for name in near.heard if name not in best.causes]
    found = [one for one in added if best.cost - one.cost > _MORE]
    return sorted(found, key=lambda one: one.cost)[:_ADDED]


def _suspicious(base: Hypothesis, left: float, doubt: float) -> bool:
    return left**2 > base.near.little + SURE * doubt


def _doubt(problem: Problem) -> float:
    """Return how far chance, and a memory known from few samples at rest, move what is left.

    A memory m that n samples tell has the variance (1 - m^2) / n (Bartlett 1946), and is off by as
    much as whitened neighbours then have in common.
    """
    counted = [np.isfinite(run.rest).sum(axis=0) for run in problem.rig.runs]
    rows = zip(counted, problem.noise, strict=True)
    rest = sum(float(np.sum(count / (1 - noise.memory**2))) for count, noise in rows)
    return float(np.sqrt(1 / problem.samples() + 1 / max(rest, 1.0)))
