"""The causes that a diagnosis leaves standing, each a model fitted to the runs that exist.

Where an answer is CLEAN, what stands is every cause that those runs can hardly show: it may be
there, of the size of its tolerance, and be no more than clutter beyond what the base imitates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.answer import APART, LEAST_WORTH, SUSPECTED, alike, evident
from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.judging import Hypothesis
from workbench.diagnose.layout import Layout
from workbench.diagnose.noise import Noise
from workbench.diagnose.problem import Linear, Slope

__all__ = ["Standing", "names_standing", "still_standing"]

_MOST = 6
_NEAR = 2 * APART  # of the cost: a named cause's rival that more runs could bring back
_BEYOND = 3.0  # tolerances that a base number lies off, where that is a cause


@dataclass(frozen=True, eq=False)
class Standing:
    """One model that stands.

    Args:
        causes: that it has; none is the base.
        z: (u,) its scaled unknowns, with the trials' own at zero.
        known: what the runs that exist say around it.
        samples: that those runs hold.
        cost: as it stands.
        weight: how likely it is among all that stand.
        unseen: whether the runs that exist cannot show its causes.
    """

    causes: tuple[str, ...]
    z: NDArray[np.float64]
    known: Linear
    samples: int
    cost: float
    weight: float
    unseen: bool = False

    @property
    def name(self) -> str:
        """Return it in words."""
        return " with ".join(self.causes) or "none of them"

    def beaten_by(self, truth: Standing) -> float:
        """Return how far this cost must lie above that of what is true, for it to be dismissed."""
        if not truth.causes:
            return -SUSPECTED  # a cause always fits better than none; it must be worth little
        return APART if self.causes else LEAST_WORTH


def names_standing(found: Diagnosis, layout: Layout) -> set[str]:
    """Return the names of the causes that stand.

    Those of the numerics are no matter of an experiment where nothing points to them.

    Args:
        found: the diagnosis.
        layout: of its unknowns and those of trials.
    """
    if found.answer.kind != "CLEAN":
        return {name for one, _ in _chosen(found) for name in one.causes}
    near = found.refits.base.near
    shown = {name for name in near.heard if np.any(near.clutter[near.layout.of_cause[name]] < 1)}
    numerics = set(layout.numerics)
    released = set(layout.releases) & set(near.heard)
    return set(layout.of_cause) - shown - released - numerics


def still_standing(found: Diagnosis, layout: Layout) -> list[Standing]:
    """Return what a diagnosis leaves standing, the most likely first; at most one: nothing to tell.

    Args:
        found: the diagnosis.
        layout: of its unknowns and those of trials.
    """
    if found.answer.kind == "CLEAN":
        return _unseen(found, layout)
    chosen = _chosen(found)
    weights = scipy.special.softmax([-cost for _, cost in chosen]) if chosen else ()
    standing = [
        _embedded(one, found.layout, layout, float(weight))
        for (one, _), weight in zip(chosen, weights, strict=True)
    ]
    return sorted(standing, key=lambda one: -one.weight)


def _chosen(found: Diagnosis) -> list[tuple[Hypothesis, float]]:
    """Return the hypotheses that a SET, or a name with near rivals, leaves, with their costs."""
    answer, refits = found.answer, found.refits
    if answer.kind == "NONE":
        return []
    reach = APART if answer.kind == "SET" else _NEAR
    chosen = [(one, one.cost) for one in alike(refits, answer.best, reach)[:_MOST]]
    if not evident(refits, answer.best):  # that nothing is there is as likely at that worth
        chosen.append((refits.base, refits.base.cost - LEAST_WORTH - refits.misjudged))
    return chosen


def _unseen(found: Diagnosis, layout: Layout) -> list[Standing]:
    """Return the base, and beside it each cause that the runs hardly show, of a likely size."""
    base = _embedded(found.refits.base, found.layout, layout, 0.0)
    unseen = names_standing(found, layout)
    names = [name for name in layout.of_cause if name in unseen]
    return [base, *(_supposed(base, name, layout, 1 / len(names)) for name in names)]


def _supposed(base: Standing, name: str, layout: Layout, weight: float) -> Standing:
    z, own = base.z.copy(), layout.of_cause[name]
    size = _BEYOND if name in layout.releases else 1.0
    upward = np.where(layout.high[own] >= size, size, -size)
    z[own] = np.clip(upward, layout.low[own], layout.high[own])
    return replace(base, causes=(name,), z=z, weight=weight, unseen=True)


def _embedded(one: Hypothesis, before: Layout, layout: Layout, weight: float) -> Standing:
    """Return a hypothesis in the row of unknowns that the trials have made longer."""
    places = _places(before, layout)
    z = np.zeros(len(layout))
    z[places] = one.fit.z
    known = _condensed(one.fit.linear, places, z)
    return Standing(one.causes, z, known, one.near.samples, one.cost, weight)


def _places(before: Layout, layout: Layout) -> NDArray[np.int_]:
    """Return where each unknown of a layout stands in a longer one, (u,)."""
    found = {
        (unknown.name, int(run)): i
        for i, (unknown, run) in enumerate(zip(layout.unknowns, layout.run, strict=True))
    }
    pairs: Sequence[tuple[str, int]] = [
        (unknown.name, int(run)) for unknown, run in zip(before.unknowns, before.run, strict=True)
    ]
    return np.array([found[pair] for pair in pairs])


@dataclass(frozen=True, eq=False)
class _Condensed(Slope):
    """The slope of a short run that stands for others.

    Args:
        squared: (u, u) of the others.
    """

    squared: NDArray[np.float64]

    @cached_property
    def squares(self) -> NDArray[np.float64]:
        """Return what is known of the runs that it stands for, (u, u)."""
        return self.squared


def _condensed(linear: Linear, places: NDArray[np.int_], z: NDArray[np.float64]) -> Linear:
    """Return a neighbourhood, in more unknowns, as one short run of the same sums of squares."""
    rows = np.concatenate(linear.jacobians)
    both = np.column_stack([rows, np.concatenate(linear.residuals)])
    short: NDArray[np.float64] = np.linalg.qr(both).R
    jacobian = np.zeros((len(short), len(z)))
    jacobian[:, places] = short[:, :-1]
    squared = np.zeros((len(z), len(z)))
    squared[np.ix_(places, places)] = linear.squares
    seen, white = np.ones((len(short), 1), dtype=bool), Noise(np.ones(1), np.zeros(1))
    slope = _Condensed(jacobian, seen, white, squared)
    return Linear(z, (-1,), [short[:, -1]], (slope,))
