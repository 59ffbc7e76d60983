"""Screening: what each candidate promises in the neighbourhood of a fit, by linear regression.

No candidate is fitted for it. Residuals are replaced by the fit's own plus their differences.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.candidates import Candidate
from workbench.diagnose.wording import together
from workbench.fit import Linear

__all__ = ["Promise", "beside", "pairs_without", "promising", "screened"]

Array = NDArray[np.float64]
Moving = Callable[[Sequence[str]], Mapping[str, bool]]
"""Names of released candidates -> shared parameters that may move -> is its prior normal?"""


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
    near: Linear, candidates: Mapping[str, Candidate], moving: Moving, at: Sequence[str] = ()
) -> list[Promise]:
    """Return what each candidate promises beside those of a hypothesis, greatest gain first.

    Args:
        near: residuals and derivatives around the hypothesis, by the numbers of all candidates.
        candidates: by name.
        moving: which parameters some candidates let move.
        at: names of the hypothesis' candidates.
    """
    others = [name for name in candidates if name not in at and beside(name, at, candidates)]
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


def promising(
    near: Linear,
    others: Sequence[Array],
    columns: Mapping[str, Sequence[int]],
    moving: Callable[[str], Mapping[str, bool]],
) -> Linear:
    """Return what is known around a fit, with those derivatives of a candidate that promise most.

    Args:
        near: with some derivatives.
        others: (m, p) each, the same over other lengths [1].
        columns: of each candidate's numbers.
        moving: which parameters it lets move.
    """
    best = {name: near.fall(moving(name)) for name in columns}
    chosen = near.jacobian.copy()
    for slopes in others:
        one = replace(near, jacobian=slopes)
        for name, own in columns.items():
            fall = one.fall(moving(name))
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
