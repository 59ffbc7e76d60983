"""Which causes and pairs are worth a refit, by what a neighbourhood foretells of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from workbench.diagnose.hypotheses import Hypothesis
from workbench.diagnose.screen import Neighbourhood, Score

__all__ = ["LIKELY", "MORE", "adding", "beside", "plausible", "promising", "worthy"]

MORE = 4.0  # of worth that a cause must promise elsewhere, and a pair beyond its better half
LIKELY = 5.0  # of worth: what is less far behind the best may be the truth
_SINGLES = 8
_ADDED, _OTHERS = 4, 4  # pairs with the best single cause, and without it
_EXPLAINED = 0.2  # noise deviations: what is left of less needs no other pair
_MISLED = 10  # times the excess cost: a neighbourhood far from the truth may be wrong by so much


def worthy(scores: Sequence[Score], share: float, least: float) -> list[Score]:
    """Return the scores that are worth a refit, best first: a share of the best, or near it."""
    ranked = sorted(scores, key=lambda one: -one.worth)[:_SINGLES]
    best = max((score.worth for score in ranked), default=0.0)
    least = max(min(share * best, best - LIKELY), least)
    return [score for score in ranked if score.worth > least]


def plausible(scores: Sequence[Score], near: Neighbourhood) -> list[Score]:
    """Return the scores whose excess over the noise is foretold to be near that of the first."""
    excess = [max(score.cost - near.samples / 2, MORE) for score in scores]
    return [score for score, over in zip(scores, excess, strict=True) if over < _MISLED * excess[0]]


def beside(near: Neighbourhood, cause: str) -> list[Score]:
    """Return the pairs of a cause that promise most, far from where any of them ends."""
    pairs = [near.alone((cause, name)) for name in near.heard if name != cause]
    return sorted(pairs, key=lambda one: one.cost)[:_ADDED]


def promising(near: Neighbourhood, singles: Sequence[Hypothesis]) -> list[Score]:
    """Return pairs that are worth a refit.

    First those that add to the best single cause, seen from its own fit; then those of two others
    that promise more from the base than it reached, for there may be pairs of which no half helps.
    """
    if not singles:
        return []
    best, found = singles[0], adding(singles[0])
    if best.beyond < _EXPLAINED:
        return found
    pairs = [pair for pair in combinations(near.heard, 2) if best.causes[0] not in pair]
    others = [one for one in map(near.score, pairs) if best.cost - one.cost > MORE]
    return [*found, *sorted(others, key=lambda one: one.cost)[:_OTHERS]]


def adding(best: Hypothesis) -> list[Score]:
    """Return pairs of a cause and another that promises more, seen from the fit of the first."""
    near = best.near
    added = [near.score((*best.causes, name)) for name in near.heard if name not in best.causes]
    found = [one for one in added if best.cost - one.cost > MORE]
    return sorted(found, key=lambda one: one.cost)[:_ADDED]
