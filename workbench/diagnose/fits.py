"""Hypotheses fitted: the base within its tolerances, and it with candidates released.

A hypothesis is the base model with some priors released. All are fitted by one recipe and weighed
at the process noise that makes each most likely, so that a cause which is found is paid for by
the forces that are no longer missing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.candidates import Candidates
from workbench.diagnose.held_out import unseen
from workbench.diagnose.hypothesis import Hypothesis, blocks_of, by_cost, noise_of
from workbench.diagnose.rig import HopperRig, Rig
from workbench.diagnose.rules import Rules
from workbench.diagnose.screening import Promise, pairs_without, screened
from workbench.fit import (
    CLOSE,
    NEAREST,
    ROUGH,
    Estimator,
    Hopper,
    Known,
    Linear,
    Parameter,
    ParameterVector,
    System,
    Transitions,
    between_steps,
    fit_system,
    likeliest,
    minimised,
    reaches,
    refined,
    weaker,
)
from workbench.progress import Progress

__all__ = ["Fits"]

Array = NDArray[np.float64]

_STEPS = 6  # evaluations of one refit
_LIKELIER = 2.0  # what a step of less process noise must gain
_OFF = 0.1
_WIDE = 5.0  # deviations of what another machine has more


class Fits:
    """Fits hypotheses to the runs of a rig.

    Args:
        rig: with its runs.
        rules: of the diagnosis; None takes those of the rig.
        progress: called at each stage.
        threads: 0 takes all cores.
        left_out: numbers of runs that are not looked at.
    """

    _known: Known | None = None  # what other runs say of some numbers

    def __init__(
        self,
        rig: Rig,
        rules: Rules | None = None,
        progress: Progress = lambda text: None,
        threads: int = 0,
        left_out: Collection[int] = (),
    ) -> None:
        self.rig, self.progress, self.threads = rig, progress, threads
        self.rules = rules or rig.rules
        runs = [k for k in range(len(rig.roles)) if k not in left_out]
        self.train = [k for k in runs if rig.roles[k] == "train"]
        self.held = [k for k in runs if rig.roles[k] != "train"]
        self.candidates = Candidates.of(rig.candidates)
        self._modes = [one.mode for one in rig.facts]
        self._limited: dict[Hypothesis, Hypothesis] = {}
        self._weighed: dict[Hypothesis, Hypothesis] = {}
        self._judged: dict[Hypothesis, tuple[Array, ...]] = {}
        self._around: dict[tuple[str, ...], Linear] = {}
        self._transitions = Transitions()

    @cached_property
    def landing(self) -> frozenset[int]:
        """Return the numbers of the runs in which a foot lands."""
        runs = [*self.train, *self.held]
        system = self.rig.system(runs, ())
        return frozenset(run for k, run in enumerate(runs) if system.lands(k))

    @cached_property
    def felt(self) -> frozenset[str]:
        """Return the names of the shared numbers, candidates' too, that a fitted run can show."""
        every = self.candidates.parameters(self.candidates)
        system = self.rig.system(self.train, [*self.rig.base, *every], self._nominal)
        shared, runs = system.parameters[: len(self.rig.base) + len(every)], range(len(self.train))
        return frozenset(p.name for p in shared if any(system.feels(k, p) for k in runs))

    def of(self, rig: Rig, without: Collection[int] = ()) -> Fits:
        """Return the same of another rig with these runs, without some by their numbers."""
        left_out = {*range(len(self.rig.roles))} - {*self.train, *self.held} | {*without}
        return Fits(rig, self.rules, self.progress, self.threads, left_out)

    @cached_property
    def _nominal(self) -> System:
        """Return the fitted runs with the base alone."""
        return self.rig.system(self.train, self.rig.base)

    def little(self, name: str) -> float:
        """Return what a candidate must promise at least to be fitted alone."""
        little = self.rules.promised * self.rules.size * self.samples([name])
        return max(self.rules.suspected, little)

    def base(self) -> Hypothesis:
        """Fit the base within its tolerances."""
        return self.whole((), {})

    def whole(
        self, names: tuple[str, ...], start: Mapping[str, float], late: Collection[str] = ()
    ) -> Hypothesis:
        """Fit a hypothesis by the whole recipe, its inputs made anew.

        Args:
            names: of its candidates.
            start: values of parameters that are not nominal.
            late: names of parameters that stay there while correction is strong.
        """
        system = self.rig.system(self.train, self._released(names), self._nominal)
        vector = self._vector(system)
        fit = fit_system(
            system, vector, start=vector.named(start), late=late, progress=self.progress,
            threads=self.threads, central=False,
        )  # fmt: skip
        return self._hypothesis(names, fit.estimator, fit.x, fit.jacobian)

    def missing(self, one: Hypothesis) -> float:
        """Return how much less likely the runs are at the process noise a whole model may have.

        In units of a gain of practical size; 0 where the hypothesis asks for no more.
        """
        least = self.rules.practical(self.samples() / self.repeats())
        return max(0.0, (self.limited(one).cost - one.cost) / self.repeats() / least)

    def limited(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted again at the process noise that a whole model may have."""
        estimator, most = one.estimator, self._whole(one)
        whole = {group: min(q, most[group]) for group, q in estimator.noise.items()}
        if whole != estimator.noise and one not in self._limited:
            self._limited[one] = self._at(one, estimator.with_noise(whole))
        return self._limited.get(one, one)

    def _whole(self, one: Hypothesis) -> dict[str, float]:
        """Return the process noise that a whole model may have, by group of joints."""
        return {g: self.rules.noise_share * q for g, q in one.estimator.system.strong.items()}

    def likelier(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis as it is or at a whole model's noise, whichever is likelier.

        Less noise may show the way to a minimum that more of it hid.
        """
        return min(one, self.limited(one), key=by_cost)

    def samples(self, names: Collection[str] = ()) -> int:
        """Return how many samples, of all channels, can show one of some causes; all if none."""
        seen = self._nominal.seen
        shown = [k for k, run in enumerate(self.train) if not names or self.shows(run, names)]
        return sum(int(np.isfinite(seen(k)).sum()) for k in shown)

    def shows(self, run: int, names: Collection[str]) -> bool:
        """Return whether a run can show one of some causes: a held foot shows none of the floor."""
        modes = (self.candidates[name].shows_in for name in names)
        return any(not one or self._modes[run] in one for one in modes)

    def repeats(self) -> float:
        """Return how often innovations repeat one another; 1 where they are white.

        With a memory m of one sample that is (1 + m) / (1 - m): what a sum scatters more.
        """
        return self.rig.repeats()

    def ended(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted to its minimum; it was compared within a standard error of it.

        Its derivatives are taken anew.
        """
        one = self.settled(one)
        slopes = one.estimator.jacobian(one.x, steps=reaches(one.jacobian), central=True)
        found = minimised(one.estimator, one.x, most=_STEPS, jacobian=slopes)
        other = self._hypothesis(one.names, one.estimator, found.x, found.jacobian)
        return min(replace(one, jacobian=slopes), other, key=by_cost)

    def promises(self, at: Hypothesis) -> list[Promise]:
        """Return what each candidate promises beside those of a hypothesis, greatest gain first."""
        self._around[at.names] = self._near(at)
        return screened(self._around[at.names], self.candidates, self._moving, at.names)

    def errors(self, one: Hypothesis, listed: Collection[str]) -> dict[str, float]:
        """Return the standard error of each number of a hypothesis that was fitted to its end.

        It is as large as if all causes that are not listed were free within their tolerances; of
        another machine than the robot nobody has stated those.
        """
        if not isinstance(self.rig, HopperRig):
            return one.deviations
        near = self._around.get(one.names) or self._near(one)
        others = [name for name in self.candidates if name not in listed]
        every = [p.name for p in self.candidates.parameters(others)]
        wider = near.wider(self._moving(one.names), every)
        return {name: error * wider[name] for name, error in one.deviations.items()}

    def _near(self, at: Hypothesis) -> Linear:
        """Return what is known around a hypothesis, by the numbers of all candidates."""
        estimator, x, steps = self._every(at)
        slopes = estimator.jacobian(x, steps=steps)
        return Linear.around(estimator, x, estimator.residuals(x), slopes)

    def _every(self, at: Hypothesis) -> tuple[Estimator, Array, Array]:
        """Return a hypothesis' estimator and numbers with all candidates, and their steps."""
        every = self.candidates.parameters(self.candidates)
        estimator, x = self._estimator(at, [*self.rig.base, *every])
        known = dict(zip(at.values, reaches(at.jacobian), strict=True))
        steps = np.array([known.get(p.name, NEAREST) for p in estimator.vector.parameters])
        return estimator, x, steps

    def pairs_without(
        self, leader: str, at: Hypothesis, promises: Sequence[Promise]
    ) -> list[tuple[tuple[str, str], Promise]]:
        """Return pairs without the best that promise as much as it does, of `pairs_without`."""
        moving, most = self._moving, self.rules.seconds
        return pairs_without(leader, at.names, promises, self.candidates, moving, most)

    def refit(self, names: Sequence[str], near: Hypothesis, promise: Promise) -> Hypothesis | None:
        """Fit a hypothesis from a neighbour and what was promised there, at the same process noise.

        It begins at what was promised and, where that is no likelier than the neighbour, there.
        Another machine is fitted as the base is.
        """
        others = {p.name for p in self.candidates.parameters(near.names)}
        known = {name: value for name, value in near.values.items() if name in others}
        added = [self.candidates[name] for name in names if name not in near.names]
        if any(one.unlike for one in added):
            absent = [p for one in added if one.unlike for p in one.absent]
            return self._either(tuple(names), known, {p.name: _WIDE * p.deviation for p in absent})
        estimator, x = self._estimator(near, self._released(names))
        goal = np.array([promise.numbers[p.name] for p in estimator.vector.parameters])
        slopes = promise.near.columns(estimator.vector, goal)
        low, high = estimator.vector.bounds
        tried = list[Hypothesis]()
        for start in (goal, x):
            start = np.clip(start, low + _OFF, high - _OFF)
            found = minimised(estimator, start, None, _STEPS, CLOSE, slopes)
            tried.append(self._hypothesis(tuple(names), estimator, found.x, found.jacobian))
            if tried[-1].cost < near.cost:
                break
        return min(tried, key=by_cost)

    def _either(
        self, names: tuple[str, ...], known: dict[str, float], wide: dict[str, float]
    ) -> Hypothesis:
        """Fit another machine from the stated numbers, and with too much of what it has more.

        Strong correction lets a little play vanish, and much may stay where it is.
        """
        one = self.likelier(self.whole(names, known))
        if not wide or self.missing(one) <= 1:
            return one
        return min(one, self.likelier(self.whole(names, known | wide, wide)), key=by_cost)

    def weighed(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted again at the process noise that makes it most likely.

        A step at a time in the end, by inputs that it makes: weighed at once, a fit ends early.
        """
        if one not in self._weighed:
            found = self.at_once(one)
            for group in filter(found.estimator.depends_on, found.estimator.system.groups):
                less = found
                while less is found or less.cost < found.cost - _LIKELIER:
                    found = less
                    less = self._at(found, refined(weaker(found.estimator, group), found.x))
            self._weighed[one] = found
        return self._weighed[one]

    def at_once(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted again at the noise, no more than its own, likeliest there."""
        estimator = likeliest(one.estimator, one.x, up=0)
        return one if estimator.noise == one.estimator.noise else self._at(one, estimator)

    def _at(self, one: Hypothesis, estimator: Estimator) -> Hypothesis:
        """Return a hypothesis fitted again at other process noise."""
        slopes, known = self._transitions.carried(one.jacobian, one.x, one.estimator, estimator)
        found = minimised(estimator, one.x, None, _STEPS, ROUGH, slopes, known=known)
        return self._hypothesis(one.names, estimator, found.x, found.jacobian)

    def settled(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis with its process noise between two steps, where that is likelier.

        Half a step off, one by the mesh of its data was 38 costlier, and by another likelier.
        """
        there = between_steps(one.estimator, one.x)
        return one if there is one.estimator else min(one, self._at(one, there), key=by_cost)

    def again(self, one: Hypothesis, near: Hypothesis) -> Hypothesis:
        """Return a hypothesis or, if that is likelier, it fitted from where one with more ended."""
        known, rows = [list(near.values).index(n) for n in one.values], near.estimator.edges[-2]
        slopes = np.vstack([near.jacobian[:rows, known], one.jacobian[one.estimator.edges[-2] :]])
        return min(one, self._from(one.names, near, ROUGH, slopes), key=by_cost)

    def moved(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis of the same runs by another mesh, fitted by this one from its end."""
        return self.at_once(self._from(one.names, one, CLOSE, one.jacobian))

    def _from(
        self, names: tuple[str, ...], near: Hypothesis, end: float, slopes: Array | None = None
    ) -> Hypothesis:
        estimator, x = self._estimator(near, self._released(names))
        found = minimised(estimator, x, None, _STEPS, end, slopes)
        return self._hypothesis(names, estimator, found.x, found.jacobian)

    def _vector(self, system: System) -> ParameterVector:
        """Return the parameters of a system with these runs' priors."""
        return ParameterVector(system.parameters, self._known)

    def _released(self, names: Sequence[str]) -> list[Parameter]:
        """Return the parameters of a hypothesis, its candidates and what they free released."""
        freed = {free for name in names for free in self.candidates[name].frees}
        base = [replace(p, released=True) if p.name in freed else p for p in self.rig.base]
        more = self.candidates.parameters(names)
        return [*base, *(replace(p, released=True) for p in more)]

    def _moving(self, names: Sequence[str]) -> dict[str, bool]:
        """Return the shared parameters that may move -> whether their prior is normal."""
        return {p.name: not p.released for p in self._released(names)}

    def _estimator(
        self, near: Hypothesis, parameters: Sequence[Parameter]
    ) -> tuple[Estimator, Array]:
        """Return a neighbour's estimator with other parameters, and its numbers."""
        before = near.estimator
        system = self.rig.system(self.train, parameters, before.system)
        vector = self._vector(system)
        estimator = Estimator.of(system, vector, before.noise, self.threads)
        return estimator, vector.named(near.values)

    def joined(self, ones: Sequence[Hypothesis]) -> Hypothesis:
        """Return as one of all runs what hypotheses of some of the runs each say; none is fitted.

        Args:
            ones: hypotheses, each of other runs; of a number that several have the last counts.
        """
        assert isinstance(self._nominal, Hopper)
        inputs, values = dict[str, Array | None](), dict[str, float]()
        for one in ones:
            system = one.estimator.system
            assert isinstance(system, Hopper)
            inputs |= zip(system.names, system.turned, strict=True)
            values |= one.values
        like = self._nominal.turning([inputs[name] for name in self._nominal.names])
        names = tuple(name for one in ones for name in one.names)
        system = self.rig.system(self.train, self._released(names), like)
        vector = self._vector(system)
        estimator = Estimator.of(system, vector, noise_of(ones), self.threads)
        x = vector.named(values)
        return self._hypothesis(names, estimator, x, np.zeros((0, len(x))))

    def _hypothesis(
        self, names: tuple[str, ...], estimator: Estimator, x: Array, jacobian: Array
    ) -> Hypothesis:
        found = estimator.innovations(x, keep=True)
        blocks = tuple(blocks_of(one, estimator.system.sample_s) for one in found)
        prior = float(np.sum(estimator.vector.priors(x) ** 2))
        return Hypothesis(names, estimator, x, blocks, prior, jacobian)

    def judged(self, one: Hypothesis) -> tuple[Array, ...]:
        """Return -2 ln p of each second, (b,) [1], of each run held out, given those fitted."""
        if one not in self._judged:
            self._judged[one] = unseen(one, self.unseen(one)) if self.held else ()
        return self._judged[one]

    def unseen(self, one: Hypothesis) -> Estimator:
        """Return the estimator of the runs held out, their inputs made by the hypothesis."""
        system = self.rig.system(self.held, one.estimator.vector.shared)
        vector = self._vector(system)
        estimator = Estimator.of(system, vector, one.estimator.noise, self.threads)
        return refined(estimator, vector.named(one.values))
