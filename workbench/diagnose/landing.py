"""Hypotheses where feet land: held runs first, then hops from the stated floor, then all together.

A hop parts from another where a landing comes a sample sooner, so that its cost is full of kinks
and a fit ends near where it began. A base without the cause bends the floor's numbers for it, and
no step leads from there to the cause. So hops are screened and begun at the floor as it is stated,
by strong correction, with what runs whose foot is held say of the other numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis, by_cost
from workbench.diagnose.screening import Promise, promising, screened
from workbench.fit import (
    NOISE_FACTOR,
    ROUGH,
    Estimator,
    Hopper,
    Linear,
    ParameterVector,
    System,
    fit_system,
    minimised,
)

__all__ = ["LandingFits"]

Array = NDArray[np.float64]

_REACHES = (-2.0, 2.0)
"""Prior deviations over which secants of a hop are taken: a tangent is the slope between two kinks.
Of friction that is 30 % higher one way it promised 3 of 2000, the secant 122 at strong correction.
"""
_SMOOTH = 1 / NOISE_FACTOR
"""Share of the strong process noise at which the cost of hops is smooth: for causes that were not
there, fits ended 6 of it apart; at 0.1 it was 30, at 0.03 it was 130."""
_STEPS = 12  # evaluations of hops there
_LAST_STEPS = 6  # of all runs in the end


class LandingFits(Fits):
    """Fits hypotheses to runs in some of which a foot lands.

    Args:
        fits: of all runs.
        still: of those whose foot is held.
        base: of those; None where there is none.
    """

    def __init__(self, fits: Fits, still: Fits, base: Hypothesis | None) -> None:
        left_out = {*range(len(fits.rig.roles))} - {*fits.train, *fits.held}
        super().__init__(still.rig, fits.rules, fits.progress, fits.threads, left_out)
        self._still = still
        self._hops = self.of(still.rig, still.train)
        self._stills = dict[tuple[str, ...], Hypothesis]()
        if base is not None:
            self._stills[()] = base
        self._landed: dict[tuple[str, ...], Hypothesis] = {}
        self._smooth: dict[tuple[str, ...], Hypothesis] = {}
        self._left = set[tuple[str, ...]]()

    def little(self, name: str) -> float:
        """Return what it must promise, of `Fits`: strong correction leaves little of hops alone."""
        return super().little(name) if self._parts([name])[0] else self.rules.suspected

    def second(self, name: str) -> float:
        """Return what it must promise beside another, of `Fits`: fits of hops take long."""
        return max(super().second(name), self.little(name))

    @cached_property
    def _determined(self) -> set[str]:
        """Return the names of the shared numbers that still runs determine."""
        if not self._still.train:
            return set()
        every = [p for one in self.candidates.values() for p in one.quantities.values()]
        system = self.rig.system(self._still.train, [*self.rig.base, *every], self._still._nominal)
        runs = range(len(system.names))
        shared = system.parameters[: len(self.rig.base) + len(every)]
        return {p.name for p in shared if any(system.feels(k, p) for k in runs)}

    def whole(
        self, names: tuple[str, ...], start: Mapping[str, float], late: Collection[str] = ()
    ) -> Hypothesis:
        """Fit a hypothesis by the whole recipe, hops from the stated floor; of `Fits`."""
        shown, landed = self._parts(names)
        if shown:
            self._stills[shown] = self._still.whole(shown, start, late)
        system, x = self._hopping(landed, shown)
        fit = fit_system(
            system, ParameterVector(system.parameters), start=x, fixed=self._determined,
            progress=self.progress, threads=self.threads, central=False,
        )  # fmt: skip
        one = self._hops._hypothesis(landed, fit.estimator, fit.x, fit.jacobian)
        self._landed[landed] = one
        return self._together(names)

    def refit(self, names: Sequence[str], near: Hypothesis, promise: Promise) -> Hypothesis | None:
        """Fit a hypothesis from what was promised; of `Fits`.

        What still runs do not show of it is fitted to hops, once; both parts are put together. None
        where that gains nothing by strong correction, whose cost is smooth: with less of it two
        fits differ by 20 to 50 whatever is there, and each takes half a minute.
        """
        shown, landed = self._parts(names)
        before = self._parts(near.names)
        if shown and shown not in self._stills:
            still = self._stills.get(before[0], self._stills[()])
            one = replace(promise, near=promise.near.of_runs(near.estimator, self._runs(False)))
            found = self._still.refit(shown, still, one)
            if found is None:
                return None
            self._stills[shown] = found
        if landed in self._left:
            return None
        if landed not in self._landed:
            one = replace(promise, near=promise.near.of_runs(near.estimator, self._runs(True)))
            if before[1] not in self._smooth:
                known = replace(one, numbers=self._own(before[1]))
                self._smooth[before[1]] = self._smoothly(before[1], before[0], known)
            smooth = self._smoothly(landed, shown, one)
            if self._smooth[before[1]].cost - smooth.cost < self.rules.suspected:
                self._left.add(landed)
                return None
            free = self._free(smooth.estimator.vector)
            self._smooth[landed], self._landed[landed] = smooth, self._hops._weighing(smooth, free)
        found = self._together(tuple(names))
        if found.cost < near.cost:
            return found
        # no less likely than its neighbour, it has not come to its end
        same = found.estimator.noise == near.estimator.noise
        other = self._from(found.names, near, ROUGH, found.jacobian if same else None)
        return min(found, other, key=by_cost)

    def _smoothly(
        self, names: tuple[str, ...], shown: tuple[str, ...], promise: Promise
    ) -> Hypothesis:
        """Fit hops from what is promised at the stated floor, where their cost is smooth."""
        like = self._landed[()].estimator
        system, x = self._hopping(names, shown, like.system)
        vector = ParameterVector(system.parameters)
        goal = [promise.numbers.get(p.name, x[k]) for k, p in enumerate(vector.parameters)]
        free = self._free(vector)
        x = np.where(free, np.clip(np.array(goal), *vector.bounds), x)
        estimator = Estimator.of(system, vector, system.strong, self.threads)
        found = minimised(estimator, x, free, _STEPS, ROUGH, promise.near.columns(vector, x))
        estimator = estimator.with_noise({g: _SMOOTH * q for g, q in system.strong.items()})
        found = minimised(estimator, found.x, free, _STEPS, ROUGH, found.jacobian, known=False)
        return self._hops._hypothesis(names, estimator, found.x, found.jacobian)

    def _own(self, names: tuple[str, ...]) -> dict[str, float]:
        """Return the numbers of candidates in hops that were fitted."""
        one = self._landed[names]
        own = {p.name for name in names for p in self.candidates[name].quantities.values()}
        every = zip(one.estimator.vector.parameters, one.x, strict=True)
        return {p.name: float(x) for p, x in every if p.name in own}

    def _free(self, vector: ParameterVector) -> NDArray[np.bool_]:
        """Return which numbers still runs do not determine, (p,)."""
        return np.array([p.name not in self._determined for p in vector.parameters])

    def ended(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted to its minimum, where the cost of hops is smooth; of `Fits`.

        With less process noise it ends at a kink, and the slopes there say too much: of seven
        intervals one held the truth.
        """
        estimator, hops = one.estimator, self._landed[()].estimator
        least = {g: q for g, q in self._whole(one).items() if hops.depends_on(g)}
        noise = {g: max(q, least.get(g, q)) for g, q in estimator.noise.items()}
        smooth = estimator.with_noise(noise)
        return super().ended(self._hypothesis(one.names, smooth, one.x, one.jacobian))

    def still_part(self, one: Hypothesis) -> tuple[Fits, Hypothesis]:
        """Return fits of the still runs, and what they show of a hypothesis."""
        return self._still, self._stills[self._parts(one.names)[0]]

    def _parts(self, names: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return those of some candidates that still runs show, and the others."""
        shown, others = list[str](), list[str]()
        for name in names:
            one = self.candidates[name]
            numbers = {*(p.name for p in one.quantities.values()), *one.frees}
            (shown if numbers & self._determined else others).append(name)
        return tuple(shown), tuple(others)

    def _hopping(
        self, names: Sequence[str], shown: tuple[str, ...], like: System | None = None
    ) -> tuple[System, Array]:
        """Return the hops of a hypothesis and its numbers: those known, and the stated floor."""
        hops = self._hops
        system = hops.rig.system(hops.train, self._released(names), like or hops._nominal)
        values = self._stills[shown].values if self._determined else {}
        start = {name: value for name, value in values.items() if name in self._determined}
        return system, ParameterVector(system.parameters).named(start)

    def _together(self, names: tuple[str, ...]) -> Hypothesis:
        """Return a hypothesis fitted to all runs, from where the still ones and hops ended."""
        shown, landed = self._parts(names)
        hops = self._landed[landed]
        if not self._determined:
            return hops
        still = self._stills[shown]
        parts = {False: (still.estimator, still.x, still.jacobian),
                 True: (hops.estimator, hops.x, hops.jacobian)}  # fmt: skip
        inputs, values = dict[str, Array | None](), dict[str, float]()
        noise = dict(still.estimator.noise)
        for estimator, x, _ in parts.values():
            system = estimator.system
            assert isinstance(system, Hopper)
            inputs |= zip(system.names, system.turned, strict=True)
            values |= {p.name: v for p, v in estimator.vector.values(x).items()}
            noise |= {g: q for g, q in estimator.noise.items() if estimator.depends_on(g)}
        assert isinstance(self._nominal, Hopper)
        like = self._nominal.turning([inputs[name] for name in self._nominal.names])
        system = self.rig.system(self.train, self._released(names), like)
        vector = ParameterVector(system.parameters)
        estimator, x = Estimator.of(system, vector, noise, self.threads), vector.named(values)
        slopes = self._slopes(estimator, x, parts)
        found = minimised(estimator, x, None, _LAST_STEPS, ROUGH, slopes)
        return self._hypothesis(names, estimator, found.x, found.jacobian)

    def _slopes(
        self, estimator: Estimator, x: Array, parts: Mapping[bool, tuple[Estimator, Array, Array]]
    ) -> Array:
        """Return the derivatives of all residuals, (m, p) [1], most of them known of the parts."""
        names = [p.name for p in estimator.vector.parameters]
        asked = np.array([k for k, name in enumerate(names) if name in self._determined])
        slopes = estimator.jacobian(x, asked, runs=self._runs(True))
        rows = self._rows(estimator)
        for landing, (part, _, known) in parts.items():
            own = [p.name for p in part.vector.parameters]
            kept = [k for k, name in enumerate(own) if not landing or name not in self._determined]
            columns = np.array([names.index(own[k]) for k in kept])
            slopes[np.ix_(rows[landing], columns)] = known[: part.edges[-2], kept]
        return slopes

    def _runs(self, landing: bool) -> list[int]:
        """Return which of the fitted runs are hops, or are not."""
        return [k for k in range(len(self.train)) if self._nominal.lands(k) == landing]

    def _rows(self, estimator: Estimator) -> dict[bool, NDArray[np.intp]]:
        """Return which residuals of all runs are those of hops, and which of still runs."""
        edges = estimator.edges
        rows = np.repeat(np.arange(len(edges) - 2), np.diff(edges[:-1]))
        return {which: np.flatnonzero(np.isin(rows, self._runs(which))) for which in (False, True)}

    def promises(self, at: Hypothesis) -> list[Promise]:
        """Return what each candidate promises, of `Fits`: in still runs alone if those show it."""
        near = self._near(at)
        alone = near.of_runs(at.estimator, self._runs(False)) if self._determined else near
        still, every = (
            {one.name: one for one in screened(part, self.candidates, self._moving, at.names)}
            for part in (alone, near)
        )
        shown = [name for name in every if self._parts([name])[0]]
        found = [
            replace(one, gain=still[name].gain, sure=still[name].sure) if name in shown else one
            for name, one in every.items()
        ]
        return sorted(found, key=lambda one: -one.gain)

    def _near(self, at: Hypothesis) -> Linear:
        """Return what is known around a hypothesis, around the stated floor in hops; of `Fits`.

        The hops' rows are of strong correction; those of a candidate that hops alone show are
        secants, that way which promises more.
        """
        estimator, x, steps = self._every(at)
        names, system = [p.name for p in estimator.vector.parameters], estimator.system
        floor = {p.name for p in self.rig.base} - self._determined
        x[[k for k, name in enumerate(names) if name in floor]] = 0.0
        noise = {group: max(q, system.strong[group]) for group, q in estimator.noise.items()}
        strong, hops = estimator.with_noise(noise), self._runs(True)
        rows = self._rows(estimator)[True]
        residuals = estimator.residuals(x)
        slopes = estimator.jacobian(x, steps=steps, runs=self._runs(False))
        residuals[rows] = strong.residuals(x)[rows]
        columns = {
            name: [names.index(p.name) for p in one.quantities.values()]
            for name, one in self.candidates.items()
            if one.quantities and name not in at.names and not self._parts([name])[0]
        }
        asked, tried = np.array([k for own in columns.values() for k in own]), list[Array]()
        slopes[rows] = strong.jacobian(x, np.setdiff1d(range(len(x)), asked), runs=hops)[rows]
        near = Linear.around(estimator, x, residuals, slopes)
        for reach in _REACHES:
            secants = strong.jacobian(x, asked, np.full(len(x), reach), runs=hops)
            tried.append(near.jacobian.copy())
            tried[-1][np.ix_(rows, asked)] = secants[np.ix_(rows, asked)]
        return promising(near, tried, columns, lambda name: self._moving((*at.names, name)))
