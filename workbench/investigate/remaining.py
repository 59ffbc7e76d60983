"""The hypotheses that a diagnosis leaves, each a model that may be true.

A SET leaves all that are alike, and the base where the best of them may be chance; a name leaves
the alternatives that are near it. Where nothing was found, what remains is every candidate that the
runs can hardly show: it may be there, of the size of its tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose import (
    Candidate,
    Diagnosis,
    Hypothesis,
    ObserverPart,
    Part,
    Rig,
    Scored,
    together,
    versus,
)
from workbench.fit import Linear, Parameter, eliminated, weights

__all__ = ["BEYOND", "MOST", "Remaining", "asked_of", "remaining"]

Array = NDArray[np.float64]

BEYOND = 2.0
"""Times the rules' thresholds by which an alternative of a name is rejected beyond doubt."""
MOST = 6
"""Hypotheses that are compared at once."""
_FREED = 1e-4  # of the curvature of a prior, for what has none


@dataclass(frozen=True, eq=False)
class Remaining:
    """One hypothesis that remains.

    Args:
        names: of its candidates; none is the base.
        parameters: of the model and of its candidates.
        values: parameter -> value [SI].
        noise: process noise of each group of joints.
        known: parameter -> its place in the information.
        information: (p, p) J' W J of the runs that exist with the priors, in numbers of unit prior
            deviation [1]; what belongs to single runs is eliminated.
        cost: -2 ln of the posterior of the fitted runs.
        blocks: (b,) -2 ln L of each second of the fitted runs [1].
        held: (h,) the same of the runs held out [1]; empty where they were not judged.
        weight: how likely it is among all that remain.
        hidden: whether the runs that exist cannot show its causes.
    """

    names: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    values: Mapping[str, float]
    noise: Mapping[str, float]
    known: Mapping[str, int]
    information: Array
    cost: float
    blocks: Array
    held: Array
    weight: float = 0.0
    hidden: bool = False

    @property
    def name(self) -> str:
        """Return it in words."""
        return together(self.names) or "none of them"

    def within(self, parameters: Sequence[Parameter]) -> Array:
        """Return the information on parameters, (p, p) [1]; a prior where no run shows them."""
        found = np.eye(len(parameters))
        places = [(i, self.known[p.name]) for i, p in enumerate(parameters) if p.name in self.known]
        if places:
            here, there = map(list, zip(*places, strict=True))
            found[np.ix_(here, here)] = self.information[np.ix_(there, there)]
        return found

    def behind(self, truth: Remaining) -> tuple[float, Array]:
        """Return by how much it costs more than what is true, and that of each second, (b,) [1]."""
        every, cost = self.blocks - truth.blocks, self.cost - truth.cost
        if len(self.held) == len(truth.held):
            held = self.held - truth.held
            every, cost = np.concatenate([every, held]), cost + float(held.sum())
        return cost, every


def remaining(found: Diagnosis, rig: Rig) -> list[Remaining]:
    """Return what a diagnosis leaves, the most likely first; at most one: nothing to separate.

    Before hidden causes, which may be more than `MOST`, the base is first.

    Args:
        found: the diagnosis.
        rig: with the base and the candidates of the runs that exist and of those that can be made.
    """
    asked = asked_of(found)
    part, fits = asked.part, asked.fits
    if part.kind in ("CLEAN", "NONE"):
        return _hidden(found, rig)
    fitted = {one.names: one for one in asked.tried}
    scored = _chosen(found, part)[:MOST]
    chosen = [
        _of(found, one, rig, fits.judged(one)) for one in (fitted[one.names] for one in scored)
    ]
    if part.kind == "SET" and not _evident(found, asked):
        chosen.append(_of(found, asked.base, rig))
    costs = np.array([one.cost for one in chosen]) / fits.repeats()
    shares = scipy.special.softmax(-costs / 2)
    chosen = [replace(one, weight=float(w)) for one, w in zip(chosen, shares, strict=True)]
    return sorted(chosen, key=lambda one: -one.weight)


def asked_of(found: Diagnosis) -> ObserverPart:
    """Return the part of the observer whose hypotheses are to be separated.

    The first that is a set, else the first that lists a cause, else the first.
    """
    parts = list(found.observer.parts.values())
    sets = [one for one in parts if one.part.kind == "SET"]
    return next(iter([*sets, *(one for one in parts if one.causes), *parts]))


def _chosen(found: Diagnosis, part: Part) -> Sequence[Scored]:
    """Return the hypotheses that are alike, or a name with the alternatives near it."""
    if part.kind == "SET":
        return part.alike
    rules, near = found.rules, [part.best]
    for one, _ in part.compared:
        if one.names == part.best.names or len(one.names) != len(part.best.names):
            continue
        behind = versus(part.best, one)
        if (
            behind.sure < BEYOND * rules.apart
            or behind.gain + behind.held < BEYOND * rules.suspected
        ):
            near.append(one)
    return near


def _evident(found: Diagnosis, asked: ObserverPart) -> bool:
    """Return whether the best is more than chance, so that the base does not remain."""
    rules, fits, part = found.rules, asked.fits, asked.part
    best = next((v for one, v in part.compared if one.names == part.best.names), None)
    least = rules.practical(fits.samples() / fits.repeats())
    return best is not None and best.gain > least and best.sure > rules.sure and best.held > 0


def _of(found: Diagnosis, one: Hypothesis, rig: Rig, judged: Sequence[Array] = ()) -> Remaining:
    """Return a hypothesis of one part of the observer, beside what holds in the other."""
    whole = found.observer.beside(one)
    shared = whole.estimator.vector.shared
    more = [p for p in rig.base if p.name not in {q.name for q in shared}]
    values = {p.name: p.nominal for p in more} | {p.name: whole.values[p.name] for p in shared}
    known, information = _information(whole)
    held = np.concatenate([np.zeros(0), *judged])
    return Remaining(
        whole.names, (*shared, *more), values, whole.estimator.noise, known, information,
        one.cost, np.concatenate(one.blocks), held,
    )  # fmt: skip


def _information(one: Hypothesis) -> tuple[dict[str, int], Array]:
    """Return what the fitted runs and the priors say of the shared parameters, (p, p)."""
    estimator, vector = one.estimator, one.estimator.vector
    jacobian = one.jacobian if len(one.jacobian) else estimator.jacobian(one.x)
    trust = weights(estimator.residuals(one.x), estimator.robust)
    curvature = jacobian.T @ (jacobian * trust[:, None]) + _FREED * np.eye(len(vector))
    known = {p.name: i for i, p in enumerate(vector.shared)}
    return known, eliminated(curvature, vector.own)


def _hidden(found: Diagnosis, rig: Rig) -> list[Remaining]:
    """Return the base, and beside it candidates at their tolerance.

    They are those that the runs hardly show, and those that show in other modes only.
    """
    base = _of(found, next(iter(found.observer.parts.values())).base, rig)
    modes = {facts.mode for facts in found.rig.facts}
    near = {one.name: one.near for one in found.observer.promises}
    least = found.rules.suspected * found.observer.fits.repeats()
    hidden = [
        one
        for one in rig.candidates
        if one.quantities
        and not (
            modes & set(one.shows_in) and _at_tolerance(one, near.get(one.name), rig.base) >= least
        )
    ]
    return [base, *(_supposed(base, one, 1 / len(hidden)) for one in hidden)]


def _at_tolerance(candidate: Candidate, near: Linear | None, base: Sequence[Parameter]) -> float:
    """Return the gain that a candidate of the size of its tolerance would have shown."""
    quantities = [p.name for p in candidate.quantities.values()]
    if near is None or not set(quantities) <= set(near.names):
        return 0.0
    names = np.array(near.names)
    ours = np.isin(names, quantities)
    kept = ours | near.own | np.isin(names, [p.name for p in base])
    curvature = (near.curvature + np.diag(np.where(ours, 0.0, 1.0)))[np.ix_(kept, kept)]
    return float(np.trace(eliminated(curvature, ~ours[kept])))


def _supposed(base: Remaining, candidate: Candidate, weight: float) -> Remaining:
    """Return the base with a candidate of the size of its tolerance."""
    quantities = tuple(candidate.quantities.values())
    values = {
        p.name: p.deviation if p.high >= p.deviation else max(-p.deviation, p.low)
        for p in quantities
    }
    return replace(
        base, names=(candidate.name,), parameters=(*base.parameters, *quantities),
        values={**base.values, **values}, weight=weight, hidden=True,
    )  # fmt: skip
