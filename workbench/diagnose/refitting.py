"""Refits of the true problem: the base alone, then with one or two causes released."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.base import FAR, ROUGH, fit_base, windows_of
from workbench.diagnose.hypotheses import (
    Hypothesis,
    Refits,
    doubt_of,
    judged,
    more_than_a_little,
)
from workbench.diagnose.problem import Linear, Problem
from workbench.diagnose.promising import (
    LIKELY,
    MORE,
    adding,
    beside,
    plausible,
    promising,
    worthy,
)
from workbench.diagnose.screen import Score
from workbench.diagnose.solve import fit, prior_of, renewed
from workbench.progress import Progress, counted

__all__ = ["refit_all"]

_BEHIND = 0.5  # share of the best worth below which no refit is tried
_FAR_BEHIND = 0.1  # the same, seen in a part of the runs only
_LITTLE = 0.5  # of worth: what promises more may be the truth where something must be there
_POOR = 0.4  # noise deviations, and share of what the base leaves: a refit that led nowhere
_KEPT = 0.5  # share of what was promised below which a neighbourhood has misled
_RETRIES = 3  # fits in growing windows are dear
_RACING = 3  # times the excess cost of the best: what is dearer leaves the race
_ARRIVING = 2  # of a race, fitted to whole runs, and what is as good as the best
_REFIT_ROUNDS = 5


def refit_all(problem: Problem, tell: Progress = lambda text: None, seed: int = 0) -> Refits:
    """Fit the base, score all causes, refit the promising ones and pairs of them.

    Causes are scored where the base follows the runs: at their ends, or, where it leaves too much
    there for any neighbourhood to reach the truth, in the longest window that it still follows.
    """
    tell("fit the base within its tolerances")
    base, window = fit_base(problem)
    search = _Search(problem, base, window, tell)
    scores, doubt = base.near.scores(), doubt_of(problem)
    if search.far:
        alone = [base.near.alone((name,)) for name in base.near.heard]
        search.race(plausible(worthy(alone, _FAR_BEHIND, MORE), base.near))
        for best in search.found(1)[:1]:
            if best.left > FAR:
                search.race(beside(base.near, best.causes[0]))
            else:
                search.refit(adding(best), best)
    else:
        least = _LITTLE if more_than_a_little(base, base.left, doubt) else MORE
        search.refit(worthy(scores, _BEHIND, least), base)
        search.refit(promising(base.near, search.found(1)), base)
    search.simplify()
    singles, pairs = search.found(1), search.found(2)
    threshold = base.near.threshold(seed)
    return Refits(base, singles, pairs, tuple(scores), threshold, doubt)


class _Search:
    """The hypotheses that were refitted so far, the best fit of each."""

    def __init__(self, problem: Problem, base: Hypothesis, window: float, tell: Progress) -> None:
        self.problem, self.base, self.window, self.tell = problem, base, window, tell
        self.best: dict[tuple[str, ...], Hypothesis] = {}
        self.retries = _RETRIES
        self.columns = None if self.far else base.fit.linear
        """All columns over whole runs, where a fit follows them: those not taken anew."""

    @property
    def far(self) -> bool:
        """Tell whether the minimum lies in no neighbourhood of the base."""
        return self.base.left > FAR

    def found(self, count: int) -> tuple[Hypothesis, ...]:
        """Return those with so many causes, best first."""
        same = [one for one in self.best.values() if len(one.causes) == count]
        return tuple(sorted(same, key=lambda one: one.cost))

    def refit(self, scores: Sequence[Score], around: Hypothesis) -> None:
        """Fit each from where the neighbourhood of a fit expects it; race those that it misled."""
        misled = []
        for k, score in enumerate(scores):
            self.tell(counted(f"refit with {' and '.join(score.causes)}", k + 1, len(scores)))
            found = self._fit(score.causes, score.z, around.fit.linear)
            short = self.base.cost - found.cost < _KEPT * (self.base.cost - score.cost)
            short = short and score.worth > MORE
            if short and found.left > max(_POOR, _POOR * self.base.left):
                misled.append(score)
        if not self.far and self.retries:
            self.race(misled[: self.retries])
            self.retries -= len(misled[: self.retries])

    def race(self, scores: Sequence[Score]) -> None:
        """Fit in growing windows, the causes released from the first on.

        What is far behind in a window does not enter the next.
        """
        layout, near = self.problem.layout, self.base.near
        windows, linear, begin = windows_of(self.problem), None, np.zeros(len(layout))
        if self.far:  # as much as the base follows is no race, and how it goes on from there known
            windows = [until for until in windows if until >= self.window]
            linear, begin = near.linear, near.z
        running = {score.causes: begin for score in scores}
        excess = dict.fromkeys(running, 0.0)
        for until in windows:
            excess = {}
            for k, (causes, z) in enumerate(running.items()):
                words = f"fit {until:g} s with {' and '.join(causes)}"
                self.tell(counted(words, k + 1, len(running)))
                prior = prior_of(layout, causes)
                found = fit(self.problem, z, prior, until, linear=linear, enough=ROUGH)
                running[causes] = found.z
                excess[causes] = max(found.cost - self.problem.samples(until) / 2, MORE)
            linear = None
            most = _RACING * min(excess.values(), default=0.0)
            running = {causes: running[causes] for causes in sorted(excess, key=excess.__getitem__)
                       if excess[causes] <= most}  # fmt: skip
        least = min(excess.values(), default=0.0)
        arriving = [causes for k, causes in enumerate(running)
                    if k < _ARRIVING or excess[causes] < least + LIKELY]  # fmt: skip
        for k, causes in enumerate(arriving):
            self.tell(counted(f"refit with {' and '.join(causes)}", k + 1, len(arriving)))
            self._fit(causes, running[causes], None)

    def simplify(self) -> None:
        """Fit each half of the best pair alone, from where the pair's fit ended.

        The better half comes first: where the pair was only fitted further than it, that shows.
        """
        reached = {one.causes[0]: one.cost for one in self.found(1)}
        for pair in self.found(2)[:1]:
            for name in sorted(pair.causes, key=lambda name: reached.get(name, np.inf)):
                singles = self.found(1)
                if singles and pair.cost > singles[0].cost - MORE:
                    return
                self._fit((name,), pair.fit.z, None)

    def _around(self, z: NDArray[np.float64], columns: NDArray[np.int_]) -> Linear:
        """Return a neighbourhood over whole runs with some columns taken anew."""
        if self.columns is not None:
            return renewed(self.problem, z, columns, np.inf, self.columns)
        self.columns = self.problem.linear(z, np.arange(len(z)))
        return self.columns

    def _fit(
        self, causes: tuple[str, ...], z: NDArray[np.float64], linear: Linear | None
    ) -> Hypothesis:
        layout = self.problem.layout
        quantities = layout.quantities(causes)
        begin = z.copy()
        begin[np.setdiff1d(layout.quantities(tuple(layout.of_cause)), quantities)] = 0.0
        if linear is not None:
            begin[layout.own()] = linear.z[layout.own()]
        prior = prior_of(layout, causes)
        near = linear or self._around(begin, prior.free)
        refresh = quantities if linear is not None else prior.free
        found = fit(self.problem, begin, prior, linear=near, refresh=refresh, rounds=_REFIT_ROUNDS)
        reached = judged(self.problem, causes, found, self.base.fit)
        if causes not in self.best or reached.cost < self.best[causes].cost:
            self.best[causes] = reached
        return reached
