"""Screening: what each candidate promises in the neighbourhood of a fit, by linear regression.

No candidate is fitted for it. Residuals are replaced by the fit's own plus their differences:
tangents where the motion is smooth; where a foot lands and slips, secants over whole prior
deviations, for there a tangent is the slope between two kinks.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.candidates import Candidate
from workbench.diagnose.linear import Linear, edges_of
from workbench.diagnose.wording import together
from workbench.fit import Estimator, ParameterVector

__all__ = ["Promise", "beside", "columns_of", "neighbourhood", "pairs_without", "screened"]

Array = NDArray[np.float64]
Moving = Callable[[Sequence[str]], Mapping[str, bool]]
"""Names of released candidates -> shared parameters that may move -> whether they have a prior."""

_REACHES = (-2.0, -0.5, 0.5, 2.0)
"""Prior deviations over which secants of a hop are taken. A sole that slides by 15 % more one way
than the other promised a gain of 7 over a tenth where it held 2300; over two it promises 1700."""


@dataclass(frozen=True, eq=False)
class Promise:
    """What a candidate promises in the neighbourhood of a fit, without a simulation of its own.

    Args:
        name: of the candidate.
        gain: by which the cost would fall, were the residuals straight.
        sure: that gain over its own scatter from second to second.
        near: residuals and derivatives of everything.
        numbers: parameter's name -> number there.
    """

    name: str
    gain: float
    sure: float
    near: Linear
    numbers: dict[str, float]


def screened(
    estimator: Estimator,
    x: Array,
    candidates: Mapping[str, Candidate],
    moving: Moving,
    steps: Array,
    at: Sequence[str] = (),
) -> list[Promise]:
    """Return what each candidate promises beside those of a hypothesis, greatest gain first.

    Args:
        estimator: with the parameters of all candidates.
        x: (p,) the minimiser's numbers of the hypothesis [1].
        candidates: by name.
        moving: which parameters some candidates let move.
        steps: (p,) how far each number is moved for its tangent [1].
        at: names of the hypothesis' candidates.
    """
    others = [name for name in candidates if name not in at and beside(name, at, candidates)]
    near = _slopes(estimator, x, candidates, moving, steps, at)
    before = near.solved(moving(at))
    found = []
    for name in others:
        after = near.solved(moving((*at, name)))
        gains = before.blocks - after.blocks
        scatter = float(np.std(gains)) * np.sqrt(len(gains))
        sure = float(gains.sum()) / max(scatter, 1e-9)
        numbers = dict(zip(near.names, after.x, strict=True))
        found.append(Promise(name, before.cost - after.cost, sure, near, numbers))
    return sorted(found, key=lambda one: -one.gain)


def _slopes(
    estimator: Estimator,
    x: Array,
    candidates: Mapping[str, Candidate],
    moving: Moving,
    steps: Array,
    at: Sequence[str],
) -> Linear:
    """Return residuals and slopes of everything, those of each candidate that promise most."""
    system, names = estimator.system, [p.name for p in estimator.vector.parameters]
    near = neighbourhood(estimator, x, estimator.residuals(x), estimator.jacobian(x, steps=steps))
    landing = [k for k in range(len(system.names)) if system.lands(k)]
    if not landing:
        return near
    columns = {
        name: [names.index(p.name) for p in one.quantities.values()]
        for name, one in candidates.items()
        if one.quantities and name not in at
    }
    asked = np.array([i for every in columns.values() for i in every])
    rows = np.concatenate([np.arange(*estimator.edges[k : k + 2]) for k in landing])
    best = {name: near.fall(moving((*at, name))) for name in columns}
    chosen = near.jacobian.copy()
    for reach in _REACHES:
        slopes = near.jacobian.copy()
        secants = estimator.jacobian(x, asked, np.full(len(x), reach), runs=landing)
        slopes[np.ix_(rows, asked)] = secants[np.ix_(rows, asked)]
        one = replace(near, jacobian=slopes)
        for name, own in columns.items():
            fall = one.fall(moving((*at, name)))
            if fall > best[name]:
                best[name], chosen[:, own] = fall, slopes[:, own]
    return replace(near, jacobian=chosen)


def pairs_without(
    leader: str,
    at: Sequence[str],
    promises: Sequence[Promise],
    candidates: Mapping[str, Candidate],
    moving: Moving,
    most: int,
) -> list[tuple[tuple[str, str], Promise]]:
    """Return pairs without the best single candidate that promise as much as it does.

    One number far beyond its tolerance can do what two do within theirs: where nothing but
    weight drives an arm, less mass is more friction with more inertia.

    Args:
        leader: name of the best candidate.
        at: names of the hypothesis' candidates.
        promises: of each candidate beside those.
        candidates: by name.
        moving: which parameters some candidates let move.
        most: pairs that are returned.
    """
    near = promises[0].near
    least = near.fall(moving((*at, leader)))
    others = [name for name in candidates if name not in (*at, leader)]
    others = [name for name in others if beside(name, at, candidates)]
    pairs = [(a, b) for a, b in combinations(others, 2) if beside(a, [b], candidates)]
    falls = [(near.fall(moving((*at, *pair))), pair) for pair in pairs]
    found = []
    for fall, pair in sorted((one for one in falls if one[0] > least), reverse=True)[:most]:
        after = near.solved(moving((*at, *pair)))
        numbers = dict(zip(near.names, after.x, strict=True))
        found.append((pair, Promise(together(pair), fall, 0.0, near, numbers)))
    return found


def beside(name: str, others: Collection[str], candidates: Mapping[str, Candidate]) -> bool:
    """Return whether a candidate may be there beside others: none replaces another of them."""
    own = candidates[name].instead_of
    return not any(one in own or name in candidates[one].instead_of for one in others)


def columns_of(near: Linear, vector: ParameterVector) -> Array:
    """Return the derivatives by some parameters, with the rows of their priors, (m, p) [1]."""
    at = {name: k for k, name in enumerate(near.names)}
    columns = near.jacobian[:, [at[p.name] for p in vector.parameters]]
    weighted = np.flatnonzero(vector.weighted)
    priors = np.zeros((len(weighted), len(vector)))
    priors[np.arange(len(weighted)), weighted] = 1.0
    return np.vstack([columns, priors])


def neighbourhood(estimator: Estimator, x: Array, residuals: Array, jacobian: Array) -> Linear:
    """Return what is known around a fit, without the priors' rows.

    Args:
        estimator: of the fit.
        x: (p,) numbers [prior deviations].
        residuals: (m,) there [1].
        jacobian: (m, p) of them [1].
    """
    vector, system, edges = estimator.vector, estimator.system, [0]
    for seen in map(system.seen, range(len(system.names))):
        edges += list(edges[-1] + seen.shape[1] * edges_of(len(seen), system.sample_s)[1:])
    count = edges[-1]
    return Linear(
        tuple(p.name for p in vector.parameters),
        vector.own,
        x,
        residuals[:count],
        jacobian[:count],
        np.array(edges),
    )
