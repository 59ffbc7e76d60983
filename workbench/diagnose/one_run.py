"""Whether a cause rests on one run: each run is left out in turn, by algebra on what was fitted.

A cause that is in the robot shows in every run that excites it. What one run alone carries is
another thing: where the other runs exclude it, that run is at fault; where they say nothing of it,
nobody knows yet. Nothing is simulated: the neighbourhood of the fit is kept by run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit
from scipy.stats import chi2

from workbench.diagnose.answer import SUSPECTED, Answer, Rival, left_over
from workbench.diagnose.hypotheses import Hypothesis, Refits, together
from workbench.diagnose.problem import Linear, Problem
from workbench.diagnose.screen import Neighbourhood

__all__ = ["Carrier", "carriers", "with_carriers"]

_LEAST_OTHERS = 2  # runs that are left must be able to speak
_EXCLUDED = 0.003  # chance by which runs that have a cause as well would disagree so much


@dataclass(frozen=True)
class Carrier:
    """A run that a cause rests on.

    Args:
        cause: its name.
        run: index of the run.
        worth: of the cause in all runs.
        without: of the cause in all other runs.
        excluded: whether the other runs exclude the cause as it was found.
    """

    cause: str
    run: int
    worth: float
    without: float
    excluded: bool


def carriers(refits: Refits, best: Hypothesis) -> list[Carrier]:
    """Return the causes of a hypothesis that rest on one run, with that run."""
    linear = best.fit.linear
    if len(linear.runs) <= _LEAST_OTHERS:
        return []
    others = {k: _without(best.near, k) for k in linear.runs}
    found = []
    for cause in best.causes:
        rest = tuple(name for name in best.causes if name != cause)
        worth = _worth(best.near, rest, best.causes)
        left = {k: _worth(near, rest, best.causes) for k, near in others.items()}
        run = min(left, key=lambda k: left[k])
        if worth > SUSPECTED > left[run]:
            excluded = _excludes(others[run], best, cause)
            found.append(Carrier(cause, run, worth, left[run], excluded))
    return found


def _without(near: Neighbourhood, run: int) -> Neighbourhood:
    """Return the same neighbourhood as seen by all other runs."""
    linear = near.linear
    kept = [at for at, k in enumerate(linear.runs) if k != run]
    chosen = Linear(
        linear.z,
        tuple(linear.runs[at] for at in kept),
        [linear.residuals[at] for at in kept],
        [linear.jacobians[at] for at in kept],
        linear.curvatures[kept],
    )
    share = sum(len(part) for part in chosen.residuals) / sum(map(len, linear.residuals))
    return Neighbourhood(near.layout, chosen, round(share * near.samples))


def _worth(near: Neighbourhood, rest: tuple[str, ...], causes: tuple[str, ...]) -> float:
    return near.lowest(rest) - near.lowest(causes)


def _excludes(others: Neighbourhood, best: Hypothesis, cause: str) -> bool:
    """Tell whether what other runs find of a cause cannot be what all runs found.

    All runs are the others and one more, so the variance of the difference is the difference of
    the variances (Hausman, Econometrica 46, 1978).
    """
    layout = others.layout
    if cause not in others.heard:
        return False
    own = layout.of_cause[cause]
    at = np.searchsorted(layout.quantities(best.causes), own, sorter=None)
    apart = others.score(best.causes).z[own] - best.fit.z[own]
    at = [list(layout.quantities(best.causes)).index(i) for i in own]
    spread = others.spread(best.causes) - best.near.spread(best.causes)
    values, axes = np.linalg.eigh(spread[np.ix_(at, at)])
    known = values > 0
    distance = float(np.sum((axes.T @ apart)[known] ** 2 / values[known]))
    return bool(distance > chi2.isf(_EXCLUDED, max(int(known.sum()), 1)))
