"""Hypotheses where feet land: of what hops alone show, by what is known of held runs.

A hop parts from another where a landing comes a sample sooner, so that its cost is full of kinks
and a fit ends near where it began. A base without the cause bends the floor's numbers for it, and
no step leads from there to the cause. So hops are screened and begun at the floor as it is stated,
by strong correction.

What runs whose foot is held say of the robot is the prior of its numbers here, so that they need
not be fitted again.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.fits import Fits
from workbench.diagnose.held_out import known_of
from workbench.diagnose.hypothesis import Hypothesis, by_cost
from workbench.diagnose.rig import HopperRig
from workbench.diagnose.screening import Promise, promising
from workbench.fit import NOISE_FACTOR, ROUGH, Estimator, Linear, minimised

__all__ = ["HopFits"]

Array = NDArray[np.float64]

_REACHES = (-2.0, 2.0)
"""Prior deviations over which secants of a hop are taken: a tangent is the slope between two kinks.
Of friction that is 30 % higher one way it promised 3 of 2000, the secant 122 at strong correction.
"""
_SMOOTH = 1 / NOISE_FACTOR
"""Share of the strong process noise at which the cost of hops is smooth: for causes that were not
there, fits ended 6 of it apart; at 0.1 it was 30, at 0.03 it was 130."""
_STEPS = 12  # evaluations of hops there


class HopFits(Fits):
    """Fits hypotheses to runs in which a foot lands.

    Args:
        fits: of all runs.
        still: of those whose foot is held.
        best: what holds in those; None where there is none.
    """

    def __init__(self, fits: Fits, still: Fits, best: Hypothesis | None) -> None:
        rig = still.rig
        assert isinstance(rig, HopperRig)
        self._stated: dict[str, float] = {}
        if best is not None:
            rig = rig.beside(best.names, still.felt)
            names = [p.name for p in rig.base if p.name in still.felt]
            self._known = known_of(best, names)
            self._stated = {name: best.values[name] for name in names}
        left_out = {*range(len(rig.roles))} - {*fits.landing}
        super().__init__(rig, fits.rules, fits.progress, fits.threads, left_out)
        self._smooth: dict[tuple[str, ...], Hypothesis] = {}

    def little(self, name: str) -> float:
        """Return what it must promise, of `Fits`: strong correction leaves little of it."""
        return self.rules.suspected

    def whole(
        self, names: tuple[str, ...], start: Mapping[str, float], late: Collection[str] = ()
    ) -> Hypothesis:
        """Fit a hypothesis by the whole recipe, from the stated floor; of `Fits`."""
        return super().whole(names, self._stated, {*late, *self._stated})

    def refit(self, names: Sequence[str], near: Hypothesis, promise: Promise) -> Hypothesis | None:
        """Fit a hypothesis from what was promised; of `Fits`.

        None where that gains nothing by strong correction, whose cost is smooth: with less of it
        two fits differ by 20 to 50 whatever is there.
        """
        if near.names not in self._smooth:
            known = replace(promise, numbers=self._own(near))
            self._smooth[near.names] = self._smoothly(near, near.names, known)
        smooth = self._smoothly(near, tuple(names), promise)
        if self._smooth[near.names].cost - smooth.cost < self.rules.suspected:
            return None
        self._smooth[smooth.names] = smooth
        found = self.at_once(smooth)
        if found.cost < near.cost:
            return found
        # no less likely than its neighbour, it has not come to its end
        same = found.estimator.noise == near.estimator.noise
        other = self._from(found.names, near, ROUGH, found.jacobian if same else None)
        return min(found, other, key=by_cost)

    def _own(self, one: Hypothesis) -> dict[str, float]:
        """Return the numbers of a hypothesis' candidates."""
        own = {p.name for p in self.candidates.parameters(one.names)}
        every = zip(one.estimator.vector.parameters, one.x, strict=True)
        return {p.name: float(x) for p, x in every if p.name in own}

    def _smoothly(self, near: Hypothesis, names: tuple[str, ...], promise: Promise) -> Hypothesis:
        """Fit a hypothesis from what is promised at the stated floor, where the cost is smooth."""
        system = self.rig.system(self.train, self._released(names), near.estimator.system)
        vector = self._vector(system)
        goal = vector.named(self._stated)
        asked = [k for k, p in enumerate(vector.parameters) if p.name in promise.numbers]
        goal[asked] = [promise.numbers[vector.parameters[k].name] for k in asked]
        goal = np.clip(goal, *vector.bounds)
        estimator = Estimator.of(system, vector, system.strong, self.threads)
        slopes = promise.near.columns(vector, goal)
        found = minimised(estimator, goal, None, _STEPS, ROUGH, slopes)
        estimator = estimator.with_noise({g: _SMOOTH * q for g, q in system.strong.items()})
        found = minimised(estimator, found.x, None, _STEPS, ROUGH, found.jacobian, known=False)
        return self._hypothesis(names, estimator, found.x, found.jacobian)

    def ended(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis fitted to its minimum, where the cost is smooth; of `Fits`.

        With less process noise it ends at a kink, and the slopes there say too much: of seven
        intervals one held the truth.
        """
        estimator, least = one.estimator, self._whole(one)
        noise = {g: max(q, least[g]) for g, q in estimator.noise.items()}
        smooth = estimator.with_noise(noise)
        return super().ended(self._hypothesis(one.names, smooth, one.x, one.jacobian))

    def _near(self, at: Hypothesis) -> Linear:
        """Return what is known around a hypothesis at the stated floor, by strong correction.

        The columns of other candidates are secants, that way which promises more.
        """
        estimator, x, _ = self._every(at)
        names, system = [p.name for p in estimator.vector.parameters], estimator.system
        base = {p.name for p in self.rig.base}
        stated = [k for k, name in enumerate(names) if name in base]
        x[stated] = estimator.vector.named(self._stated)[stated]
        noise = {group: max(q, system.strong[group]) for group, q in estimator.noise.items()}
        strong = estimator.with_noise(noise)
        columns = {
            name: [names.index(p.name) for p in one.quantities.values()]
            for name, one in self.candidates.items()
            if one.quantities and name not in at.names
        }
        asked = np.array([k for own in columns.values() for k in own], dtype=np.int64)
        tried = list[Array]()
        slopes = strong.jacobian(x, np.setdiff1d(range(len(x)), asked))
        near = Linear.around(strong, x, strong.residuals(x), slopes)
        for reach in _REACHES:
            secants = strong.jacobian(x, asked, np.full(len(x), reach))
            tried.append(near.jacobian.copy())
            tried[-1][:, asked] = secants[: len(tried[-1]), asked]
        return promising(near, tried, columns, lambda name: self._moving((*at.names, name)))
