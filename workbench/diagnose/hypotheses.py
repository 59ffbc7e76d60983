"""Refits of the true problem: the base alone, then with one or two causes released."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.judging import Hypothesis, contradiction, judged, left_together
from workbench.diagnose.minimum import prior_of
from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.search import (
    BEHIND,
    FAR,
    MORE,
    POOR,
    Search,
    followed_by,
    leading,
    windows_of,
)
from workbench.diagnose.solve import TRIALS, fit
from workbench.progress import Progress

__all__ = ["SURE", "Refits", "doubt_of", "refit_all"]

SURE = 3.0
"""Standard errors: what is that far off is no chance."""

_SINGLES = 8
_ADDED, _OTHERS = 4, 4  # pairs with the best single cause, and without it
_EXPLAINED = 0.2  # noise deviations: what is left of less needs no other pair
_FAR_BEHIND = 0.1  # share of the best worth, seen in a part of the runs only
_FAR_TRIALS = 8  # of a base that cannot follow the runs anyway
_LIKELIEST = 2  # causes that are taken up where runs are compared in another way
_LIKELY = 5.0  # of worth: what is less far behind the best may be the truth
_WHOLE = 2  # that are fitted to whole runs beside those of a race
_LITTLE = 0.5  # of worth: what promises less is not the truth


class _Start(NamedTuple):
    """Where the search begins.

    Args:
        base: without causes.
        close: all causes around its fit of the longest window that it follows.
        window: how long that is; zero where it follows none, or whole runs [s].
        followed: how long it follows each run, a second at least; inf to its end [s].
    """

    base: Hypothesis
    close: Neighbourhood
    window: float
    followed: dict[int, float]


@dataclass(frozen=True, eq=False)
class Refits:
    """All that were refitted.

    Args:
        problem: whose runs were fitted; hops may be compared for a shorter time than at first.
        base: without causes.
        singles: with one cause, best first.
        pairs: with two, best first.
        scores: of every single cause, from the neighbourhood of the base.
        threshold: worth that noise alone reaches once in a hundred times.
        doubt: standard error of the square of what is left and hangs together.
    """

    problem: Problem
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
        return self.base.left > FAR

    def suspicious(self, left: float) -> bool:
        """Tell whether noise deviations that are left are more than a little of every cause is."""
        return _suspicious(self.base, left, self.doubt)

    @property
    def likely(self) -> tuple[Hypothesis, ...]:
        """Return the best single causes, if they are worth more than a little."""
        return tuple(one for one in self.singles[:_LIKELIEST] if self.worth(one) > MORE)

    def worth(self, hypothesis: Hypothesis) -> float:
        """Return how much cheaper it is than the base with its clutter."""
        return self.base.cost - hypothesis.cost

    @cached_property
    def misjudged(self) -> float:
        """Return by how much the costs of hypotheses, with their clutter, may be wrong.

        The greatest contradiction tells how far any two costs may be off. Numerics are steps of
        one, whose costs jump.
        """
        numerics = set(self.base.near.layout.numerics)
        off = 0.0
        for one in (*self.singles, *self.pairs):
            halves = [half for half in self.singles if set(half.causes) < set(one.causes)]
            if not numerics & set(one.causes):
                off = max(off, contradiction(one, (self.base, *halves)))
        return off


def refit_all(
    problem: Problem,
    tell: Progress = lambda text: None,
    seed: int = 0,
    before: Refits | None = None,
) -> Refits:
    """Fit the base, score all causes, refit the promising ones and pairs of them.

    Causes are scored where the base follows the runs: at their ends, or, where it leaves too much
    there for any neighbourhood to reach the truth, in the longest window that it still follows.
    Where nothing follows runs that forget, they are compared only for as long as the base does.
    Where what is promised is too little to believe, or does not hold, those race that the window
    which comes next promises most of. A second cause is sought where one leaves more than a little
    of every cause makes.

    Args:
        problem: with its runs.
        tell: is told each stage.
        seed: of the draws.
        before: of the same runs, compared in another way: the base begins where it ended there,
            and causes that were promising there are fitted as well. None begins as stated.
    """
    tell("fit the base within its tolerances")
    start = _base(problem, None if before is None else before.base.fit.z)
    search, scores = Search(problem, start.base, tell), start.close.scores()
    doubt = doubt_of(problem)
    _seek_first(search, scores, doubt)
    if before is not None:
        search.take_up(before.likely)
    shorter = problem.shortened(start.followed) if search.lost else None
    if shorter is not None:
        tell("compare hops only for as long as the base follows them")
        return refit_all(shorter, tell, seed, before)
    if search.far and not search.found(1):
        search.race_others(start.close, start.window)
        search.arrive(1)
    search.doubt_base(scores)
    _seek_second(search, start, doubt)
    if search.far and search.unexplained:
        _seek_elsewhere(search, start, doubt)
    search.arrive(2)
    search.simplify()
    search.reconcile()
    base, singles, pairs = search.base, search.found(1), search.found(2)
    threshold = base.near.threshold(seed)
    return Refits(problem, base, singles, pairs, tuple(scores), threshold, doubt)


def _seek_first(search: Search, scores: Sequence[Score], doubt: float) -> None:
    """Fit the single causes that are promising where the base follows the runs.

    What a far base leaves may be large because a cause is: where clutter makes up for it, those
    that are promising over whole runs are fitted as well.
    """
    something = search.far or _suspicious(search.base, search.base.left, doubt)
    chosen = _worthy(scores, search.far, something)
    if not search.far:
        search.refit(chosen, _worthy(scores, True, something))
    elif scores and scores[0].worth > MORE:
        search.race(chosen)
    if search.far and search.base.beyond <= POOR:
        whole = _worthy(search.base.near.scores(), False, something)
        whole = [one for one in whole if one.causes not in search.best]
        tied = [one for one in whole[_WHOLE:] if one.worth > whole[0].worth - _LIKELY]
        search.refit([*whole[:_WHOLE], *tied])
    search.arrive(1)


def _seek_elsewhere(search: Search, start: _Start, doubt: float) -> None:
    """Let those race that were not promising, and seek a second cause beside one that wins."""
    before = search.found(1)[:1]
    search.race_others(start.close, start.window)
    search.arrive(1)
    if search.found(1)[:1] != before:
        _seek_second(search, start, doubt)


def _seek_second(search: Search, start: _Start, doubt: float) -> None:
    """Fit pairs of the best single cause and others, where it leaves more than a little of each.

    Where it leaves so much that its fit may lie in another valley, those that add to it in the
    longest window that it follows race from there, unless clutter makes up for all of it and one of
    those that add to it over whole runs follows them.
    """
    for best in search.found(1)[:1]:
        if search.far and (best.left > FAR or best.beyond > POOR):
            if best.beyond <= POOR:
                search.refit(_adding(best)[:_WHOLE])
            if min((one.left for one in search.found(2)), default=np.inf) > FAR:
                near, until = search.close_to(best.causes) or (start.close, start.window)
                search.race(_beside(near, best.causes[0]), near.z if until else None, until)
        elif _suspicious(search.base, best.left, doubt):
            search.refit(_adding(best) if search.far else _promising(start.close, best))


def _base(problem: Problem, begin: NDArray[np.float64] | None = None) -> _Start:
    """Fit the base to growing windows, and to whole runs; near where it ends, to those at once."""
    layout = problem.layout
    prior, every = prior_of(layout), np.arange(len(layout))
    z = np.zeros(len(layout)) if begin is None else begin
    trials, follows, damping = TRIALS, True, 0.0
    place, shown, window, before = z, np.inf, 0.0, 0.0
    followed = dict.fromkeys(problem.runs, 0.0)
    for until in windows_of(problem) if begin is None else ():
        found = leading(problem, z, prior, until, damping)
        z, damping = found.z, found.damping
        follows = follows and left_together(problem, problem.runs, found.residuals) < FAR
        window = until if follows else window
        if follows or shown == np.inf:
            place, shown = z, until
        followed |= {k: until for k in followed_by(problem, found) if followed[k] == before}
        before = until
        problem.look_again(z)
        twice = found.cost > problem.samples(until)  # what noise leaves
        trials = _FAR_TRIALS if twice else TRIALS
    first = fit(problem, z, prior, trials=trials, settle=False, damping=damping)
    z = first.z
    linear = problem.linear(z, every)
    found = fit(problem, z, prior, linear=linear, trials=trials, settle=False,
                damping=first.damping)  # fmt: skip
    base = judged(problem, (), found)
    least = min(windows_of(problem), default=np.inf)
    followed = {k: max(until, least) for k, until in followed.items()}
    followed |= dict.fromkeys(followed_by(problem, found), np.inf)
    if base.left <= FAR or shown == np.inf:
        return _Start(base, base.near, 0.0, followed)
    close = problem.linear(place, every, shown)
    return _Start(base, Neighbourhood(layout, close, problem.samples(shown)), window, followed)


def _worthy(scores: Sequence[Score], far: bool, something: bool) -> list[Score]:
    """Return the scores that are worth a refit: a share of the best, or near it.

    Args:
        scores: best first.
        far: whether the base cannot follow the runs.
        something: whether something must be there, however little each cause promises.
    """
    best = max((score.worth for score in scores), default=0.0)
    if best < MORE and not something:
        return []
    share = (_FAR_BEHIND if far else BEHIND) * best
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
    others = [one for one in map(near.score, pairs) if best.cost - one.cost > MORE]
    return [*found, *sorted(others, key=lambda one: one.cost)[:_OTHERS]]


def _adding(best: Hypothesis) -> list[Score]:
    """Return pairs of a cause and another that promises more, seen from the fit of the first."""
    near = best.near
    added = [near.score((*best.causes, name)) for name in near.heard if name not in best.causes]
    found = [one for one in added if best.cost - one.cost > MORE]
    return sorted(found, key=lambda one: one.cost)[:_ADDED]


def _suspicious(base: Hypothesis, left: float, doubt: float) -> bool:
    return left**2 > base.near.little + SURE * doubt


def doubt_of(problem: Problem) -> float:
    """Return how far chance, and a memory known from few samples at rest, move what is left.

    A memory m that n samples tell has the variance (1 - m^2) / n (Bartlett 1946), and is off by as
    much as whitened neighbours then have in common.
    """
    counted = [np.isfinite(run.rest).sum(axis=0) for run in problem.rig.runs]
    rows = zip(counted, problem.noise, strict=True)
    rest = sum(float(np.sum(count / (1 - noise.memory**2))) for count, noise in rows)
    return float(np.sqrt(1 / problem.samples() + 1 / max(rest, 1.0)))
