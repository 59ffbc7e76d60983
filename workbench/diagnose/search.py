"""The search among hypotheses: fits from a neighbourhood, races, and second looks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.judging import DEARER, Hypothesis, contradiction, judged, left_together
from workbench.diagnose.minimum import Prior, prior_of
from workbench.diagnose.problem import Linear, Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.solve import Fit, fit, renewed
from workbench.progress import Progress, counted

__all__ = ["BEHIND", "FAR", "MORE", "POOR", "Search", "followed_by", "leading", "windows_of"]

BEHIND = 0.5
"""Share of the best worth below which no refit is tried."""
FAR = 1.0
"""Noise deviations that a fit leaves: the minimum lies in no neighbourhood of it."""
MORE = 4.0
"""Of worth that a pair must promise beyond its better half."""
POOR = 0.4
"""Noise deviations, and share of what the base leaves: a refit that led nowhere."""

_WINDOWS_S = (1.0, 2.5, 5.0)
"""How much of each run the first fits see: a lightly damped beam forgets nothing, and a fit of
whole runs that starts far off falls into a wrong valley."""
_ROUGH, _LEADING = 1.0, 0.1
"""Of the cost, and of its excess over noise: enough for a fit that only leads to the next."""
_MOST_RACING = 8  # of more, those that the first lap's neighbourhood promises most of
_RACING = 3  # times the excess cost of the best: what is dearer leaves the race
_ARRIVING, _MOST_ARRIVING = 2, 5  # of a race, fitted to whole runs; more than two where they tie
_GOING_ON = 3  # where trials were used up
_SURPRISING = 2.0  # times what was promised: the base may have stopped on its way, not the cause
_KEPT = 0.5  # share of what was promised below which a neighbourhood has misled
_RETRIES = 3  # fits in growing windows are dear
_REFIT_TRIALS = 12


@dataclass(frozen=True, eq=False)
class _Racer:
    """Causes in a race: where they are, the damping of the last step, the cost beyond noise."""

    causes: tuple[str, ...]
    z: NDArray[np.float64]
    damping: float = 0.0
    excess: float = 0.0


class Search:
    """The hypotheses that were refitted so far, the best fit of each."""

    def __init__(self, problem: Problem, base: Hypothesis, tell: Progress) -> None:
        self.problem, self.base, self.tell = problem, base, tell
        self.best: dict[tuple[str, ...], Hypothesis] = {}
        self.retries = _RETRIES
        self._followed: dict[tuple[str, ...], tuple[NDArray[np.float64], float]] = {}

    @property
    def far(self) -> bool:
        """Tell whether the minimum lies in no neighbourhood of the base."""
        return self.base.left > FAR

    @property
    def unexplained(self) -> bool:
        """Tell whether all that were fitted leave what no clutter explains."""
        return min((one.beyond for one in self.best.values()), default=np.inf) > POOR

    @property
    def lost(self) -> bool:
        """Tell whether a run that forgets is followed by no fit, neither the base's nor another."""
        return all(map(self._loses, (self.base, *self.best.values())))

    def _loses(self, one: Hypothesis) -> bool:
        kept, problem = followed_by(self.problem, one.fit), self.problem
        return any(problem.rig.runs[k].forgets for k in problem.runs if k not in kept)

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
            short = short and score.worth > MORE
            if short and found.left > max(POOR, POOR * self.base.left):
                misled.append(score)
        reached = min((one.cost for one in self.best.values()), default=np.inf)
        again = [score for score in misled if score.cost < reached][: self.retries]
        if again and not self.far:
            self.race([*again, *(one for one in rivals if one not in again)])
            self.retries -= len(again)

    def take_up(self, others: Sequence[Hypothesis]) -> None:
        """Fit causes that were fitted to the same runs in another way, each from its place there.

        Args:
            others: as they were fitted; those that were fitted here as well are left alone.
        """
        fresh = [one for one in others if one.causes not in self.best]
        for k, one in enumerate(fresh):
            words = f"take up {' and '.join(one.causes)}"
            self.tell(counted(words, k + 1, len(fresh)))
            self._fit_anew(one.causes, one.fit.z)

    def race(
        self, scores: Sequence[Score], begin: NDArray[np.float64] | None = None, after: float = 0.0
    ) -> None:
        """Fit in growing windows, the causes released from the first one on.

        What is far behind in a window does not enter the next. The best two are fitted to whole
        runs, and those that tie with them. Of many, those race that the neighbourhood of the first
        window promises most of: what follows is told there, if not yet in the window before.

        Args:
            scores: whose causes race.
            begin: (u,) where they begin; None is as stated. Derivatives are taken there once for
                all of them.
            after: how much of each run they need not be told apart by [s].
        """
        origin = np.zeros(len(self.problem.layout)) if begin is None else begin
        running = [_Racer(score.causes, origin) for score in scores]
        laps = [until for until in windows_of(self.problem) if until > after]
        laps = laps or [np.inf] * (after > 0)
        linear = self._shared(origin, running, laps[0]) if laps and running else None
        if linear is not None and len(running) > _MOST_RACING:
            near = Neighbourhood(self.problem.layout, linear, self.problem.samples(laps[0]))
            running = sorted(running, key=lambda one: near.lowest(one.causes))[:_MOST_RACING]
        for until in laps:
            running, linear = self._lap(running, until, linear), None
        tied = (1 + _LEADING) * min((one.excess for one in running), default=0.0) + MORE
        also = [one for one in running[_ARRIVING:_MOST_ARRIVING] if one.excess <= tied]
        arriving = [*running[:_ARRIVING], *also]
        for k, one in enumerate(arriving):
            words = f"refit with {' and '.join(one.causes)}"
            self.tell(counted(words, k + 1, len(arriving)))
            self._fit_anew(one.causes, one.z, one.damping)

    def close_to(self, causes: tuple[str, ...]) -> tuple[Neighbourhood, float] | None:
        """Return all causes around the longest lap of a race in which some causes held, and it [s].

        What a second cause adds shows there. At the end of whole runs, which one cause alone cannot
        follow, its fit may lie in another valley than both together.
        """
        if causes not in self._followed:
            return None
        z, until = self._followed[causes]
        self.tell(f"take derivatives over {_seconds(until)} with {' and '.join(causes)}")
        layout = self.problem.layout
        linear = self.problem.linear(z, np.arange(len(layout)), until)
        return Neighbourhood(layout, linear, self.problem.samples(until)), until

    def race_others(self, near: Neighbourhood, followed: float) -> None:
        """Race the single causes that were not fitted to whole runs yet.

        Args:
            near: of the base, where it follows the runs.
            followed: for how long it does [s]; no longer than that they are alike.
        """
        names = [name for name in self.problem.layout.of_cause if (name,) not in self.best]
        others = sorted((near.score((name,)) for name in names), key=lambda one: one.cost)
        self.race(others, near.z if followed else None, followed)

    def _shared(self, z: NDArray[np.float64], racing: Sequence[_Racer], until: float) -> Linear:
        """Return the neighbourhood where all who race begin, by all that they free."""
        self.tell(f"take derivatives for {len(racing)} that race")
        columns = [prior_of(self.problem.layout, one.causes).free for one in racing]
        return self.problem.linear(z, np.unique(np.concatenate(columns)), until)

    def _lap(self, running: Sequence[_Racer], until: float, linear: Linear | None) -> list[_Racer]:
        """Fit all to one window, and return those that stay in the race, best first."""
        noise, done = self.problem.samples(until) / 2, []
        for k, one in enumerate(running):
            words = f"fit {_seconds(until)} with {' and '.join(one.causes)}"
            self.tell(counted(words, k + 1, len(running)))
            prior = prior_of(self.problem.layout, one.causes)
            found = leading(self.problem, one.z, prior, until, one.damping, linear)
            excess = max(found.cost - noise, MORE)
            done.append(_Racer(one.causes, found.z, found.damping, excess))
            if left_together(self.problem, self.problem.runs, found.residuals) < FAR:
                self._followed[one.causes] = found.z, until
        done.sort(key=lambda one: one.excess)
        return [one for one in done if one.excess <= _RACING * done[0].excess]

    def arrive(self, count: int) -> None:
        """Go on with those that explain about the most, where their trials were used up.

        One that stopped on its way may be the truth, and fall to a rival that arrived.
        """
        found = sorted(self.found(count), key=lambda one: one.fit.cost)
        most = max((self._gained(one) for one in found), default=0.0)
        near = [one for one in found if self._gained(one) >= BEHIND * most]
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
            if self.far or worth < _SURPRISING * promised.get(best.causes, 0.0) + MORE:
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
        base = judged(self.problem, (), found)
        if base.cost < self.base.cost:
            self.base = base
            self.best = {
                causes: replace(one, size=one.fit.apart(found, one.near.samples))
                for causes, one in self.best.items()
            }

    def reconcile(self) -> None:
        """Judge those again that contradict one of fewer causes, which was fitted later."""
        for causes in sorted(self.best, key=len):
            one, fewer = self.best[causes], self._fewer(causes)
            if contradiction(one, fewer) > DEARER:
                self.tell(f"judge {' and '.join(causes)} again")
                again = judged(self.problem, causes, one.fit, fewer)
                self.best[causes] = min(one, again, key=lambda one: one.cost)

    def simplify(self) -> None:
        """Fit each half of the best pair alone, from where the pair's fit ended."""
        pairs, singles = self.found(2), self.found(1)
        if not pairs or (singles and pairs[0].cost > singles[0].cost - MORE):
            return
        for name in pairs[0].causes:
            self._fit_anew((name,), pairs[0].fit.z)

    def _refit(self, causes: tuple[str, ...]) -> Hypothesis:
        """Fit from the best that was found with fewer of the causes: it should not end dearer."""
        layout = self.problem.layout
        origin = min(self._fewer(causes), key=lambda one: one.fit.cost)
        fresh = tuple(name for name in causes if name not in origin.causes)
        place, linear = layout.taken_over(origin.fit.z, fresh), origin.fit.linear
        if origin is not self.base:
            linear = renewed(self.problem, place, layout.quantities(fresh), np.inf, linear)
        return self._fit(causes, place, linear, layout.quantities(causes))

    def _fewer(self, causes: tuple[str, ...]) -> list[Hypothesis]:
        """Return the base, and what was fitted with some of the causes."""
        return [self.base, *(one for one in self.best.values() if set(one.causes) < set(causes))]

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
        hypothesis = judged(self.problem, causes, found, self._fewer(causes))
        if causes not in self.best or hypothesis.cost < self.best[causes].cost:
            self.best[causes] = hypothesis
        return hypothesis


def _seconds(until: float) -> str:
    return f"{until:g} s" if until < np.inf else "whole runs"


def followed_by(problem: Problem, found: Fit) -> list[int]:
    """Return the runs that a fit follows."""
    pairs = zip(problem.runs, found.residuals, strict=True)
    return [k for k, left in pairs if left_together(problem, [k], [left]) < FAR]


def leading(
    problem: Problem,
    z: NDArray[np.float64],
    prior: Prior,
    until: float,
    damping: float,
    linear: Linear | None = None,
) -> Fit:
    """Return a fit of the first seconds that only leads to a longer window, or out of a race."""
    return fit(problem, z, prior, until, linear, enough=_ROUGH, rough=_LEADING, settle=False,
               damping=damping)  # fmt: skip


def windows_of(problem: Problem) -> list[float]:
    """Return how much of each run the fits that lead to one of whole runs see [s]."""
    longest = max(float(problem.rig.runs[k].times[-1]) for k in problem.runs)
    return [window for window in _WINDOWS_S if window < longest]
