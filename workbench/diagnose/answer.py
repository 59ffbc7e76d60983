"""From refits to an answer: which cause, which set of causes, none of them, or nothing wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.hypotheses import SURE, Refits
from workbench.diagnose.judging import Hypothesis
from workbench.diagnose.layout import Layout
from workbench.diagnose.search import FAR, POOR

__all__ = [
    "LEAST_SIZE",
    "LEAST_WORTH",
    "NOTHING_LEFT",
    "SUSPECTED",
    "Answer",
    "Kind",
    "Rival",
    "alike",
    "believable",
    "decide",
    "evident",
    "left_over",
    "negligible",
    "widened",
]

Residuals = Sequence[NDArray[np.float64]]
Kind = Literal["NAMED", "SET", "NONE", "CLEAN", "DATA_FAULT"]

LEAST_WORTH = 8.0
"""Of the cost, in favour of a cause: 1 in 3000 by its clutter, for some thirty of them."""
SUSPECTED = 4.0
"""Of the cost: a cause that is worth so much may well be there, and is listed as one of a set."""
LEAST_SIZE = 0.12
"""Noise deviations: what explains less, in runs fitted and held out, is of no practical size."""
NOTHING_LEFT = 0.25
"""Noise deviations that may be left unexplained: they are of no practical size."""
APART = 5.0
"""Of the cost: a rival so far behind is 150 times less likely."""
_LEFT_SHARE = 0.3  # of what hung together before


@dataclass(frozen=True)
class Rival:
    """A cause that was not taken, and why."""

    name: str
    why_not: str


@dataclass(frozen=True, eq=False)
class Answer:
    """What the refits say.

    Args:
        kind: of the answer.
        causes: those named, or all of a set; empty for NONE and CLEAN.
        best: the hypothesis that holds; that of the base where no cause does.
        weights: of the evidence for each cause among all that were tried, 0 to 1.
        rivals: what was not taken.
        reason: in a sentence.
    """

    kind: Kind
    causes: tuple[str, ...]
    best: Hypothesis
    weights: dict[str, float]
    rivals: tuple[Rival, ...]
    reason: str


def decide(
    refits: Refits,
    layout: Layout,
    shown: Callable[[Hypothesis], bool] = lambda one: False,
    adding: Callable[[Hypothesis, Sequence[Hypothesis]], list[Hypothesis]] = lambda one, more: [],
) -> Answer:
    """Return the answer that the refits allow.

    Args:
        refits: of the runs that were fitted.
        layout: of the unknowns.
        shown: whether what a hypothesis explains is of practical size in runs held out. It is
            asked only where the evidence is enough and the size in the runs fitted is not.
        adding: which pairs, of some that have a named cause, make up in runs held out for most of
            what that cause leaves there. It is asked only where one of them is cheaper.
    """
    best = _best(refits, shown) or _suspect(refits)
    if best is None:
        return _without_cause(refits)
    same = alike(refits, best, APART)
    added = _added(refits, best, adding) if len(same) == 1 and evident(refits, best) else []
    if added:
        best, same = added[0], added
    left, before = best.beyond, refits.base.left
    if left_over(refits, left) and left > _LEFT_SHARE * before:
        return Answer(
            "NONE", (), best, {}, _rivals(refits, layout, best, ()),
            f"{' with '.join(best.causes)} explains a part, but {left:.2f} noise deviations are "
            f"left of {before:.2f}, and no known cause explains them",
        )  # fmt: skip
    weights = _weights(refits, best, same, added or refits.with_as_many(len(best.causes)))
    causes = tuple(sorted(weights, key=lambda name: -weights[name]))
    rivals = _rivals(refits, layout, best, causes)
    if len(same) > 1 or not evident(refits, best):
        return Answer("SET", causes, best, weights, rivals, _why_a_set(refits, best, causes))
    causes = tuple(sorted(best.causes, key=lambda name: name in layout.numerics))
    groups = {layout.causes[name].group for name in causes}
    kind: Kind = "DATA_FAULT" if groups == {"sensor"} else "NAMED"
    reason = f"{' and '.join(causes)}: every other cause leaves clearly more unexplained"
    reason += ", in runs held out as well" if added else ""
    return Answer(kind, causes, best, weights, rivals, reason)


def evident(refits: Refits, best: Hypothesis) -> bool:
    """Tell whether it is worth more than chance, and what costs may be wrong by, could make it."""
    return refits.worth(best) > LEAST_WORTH + refits.misjudged


def _why_a_set(refits: Refits, best: Hypothesis, causes: tuple[str, ...]) -> str:
    names, worth = ", ".join(causes), refits.worth(best)
    if evident(refits, best):
        return f"{names} cannot be told apart by these runs"
    if worth > LEAST_WORTH:
        return (
            f"{names} may be there, worth {worth:.1f}, but the fits contradict each other by "
            f"{refits.misjudged:.1f}, so a mixture may do as well"
        )
    return f"{names} may be there, but so small a misfit may also be a mixture"


def _best(refits: Refits, shown: Callable[[Hypothesis], bool]) -> Hypothesis | None:
    """Return the hypothesis that holds: a pair only where one cause is clearly not enough."""
    single = refits.singles[0] if refits.singles else None
    if single is not None and not _holds(refits, single, refits.base, shown):
        single = None
    for pair in refits.pairs:
        if _holds(refits, pair, single or refits.base, shown):
            return pair
    return single


def _holds(
    refits: Refits, one: Hypothesis, simpler: Hypothesis, shown: Callable[[Hypothesis], bool]
) -> bool:
    """Tell whether a hypothesis is worth more than a simpler one, and of practical size.

    Base numbers that are off may hide most of a cause in the runs that they were fitted to, not in
    others. How runs scatter does not matter where one cause misses them by far and two follow them.
    """
    gained = simpler.cost - one.cost - refits.misjudged
    size = one.fit.apart(simpler.fit, one.near.samples)
    if len(simpler.causes) == 1 and not (simpler.left > FAR and one.left < POOR):
        wider = _scatter(simpler, one)
        gained = believable(gained / wider, wider, len(one.fit.linear.runs))
    least = SUSPECTED if simpler is refits.base and len(one.causes) == 1 else LEAST_WORTH
    if gained <= max(least, refits.threshold):
        return False
    return size > LEAST_SIZE or (simpler is refits.base and gained > LEAST_WORTH and shown(one))


def _added(
    refits: Refits,
    single: Hypothesis,
    adding: Callable[[Hypothesis, Sequence[Hypothesis]], list[Hypothesis]],
) -> list[Hypothesis]:
    """Return the pairs that a named cause is one of, as runs held out tell, best first.

    How the runs fitted scatter, and fits that contradict each other, may hide a second cause that
    is plain in runs which no fit has seen. They are believed where the cheapest pair is one of
    those that they speak for.
    """
    least = single.cost - max(LEAST_WORTH, refits.threshold)
    pairs = [one for one in refits.pairs if set(single.causes) < set(one.causes)]
    cheaper = [one for one in pairs if one.cost < least]
    added = adding(single, pairs) if cheaper else []
    return added if added and cheaper[0] in added else []


def _suspect(refits: Refits) -> Hypothesis | None:
    """Return the best single cause where more is left than the clutter of all causes makes.

    It is not sure enough to be named, nor is any other, but to say that nothing is there would be
    wrong as well.
    """
    if not refits.singles or refits.far or left_over(refits, refits.base.beyond):
        return None
    return refits.singles[0] if refits.suspicious(refits.base.left) else None


def alike(refits: Refits, best: Hypothesis, reach: float) -> list[Hypothesis]:
    """Return the hypotheses with as many causes as the best that are less than so far behind."""
    same = refits.with_as_many(len(best.causes))
    return [one for one in same if _behind(refits, one, best) < reach]


def _behind(refits: Refits, one: Hypothesis, best: Hypothesis) -> float:
    """Return how much dearer a hypothesis is than another, as if noise alone parted their costs.

    What clutter that was not fitted to the end may have done to either cost is taken off first;
    where it did something, a rival whose fit alone is cheaper is not behind.

    Where the other leaves residuals u and the predictions part by d, the costs part by the sum of
    u d + d^2 / 2. Noise gives the first term the variance of the sum of d^2. What no hypothesis
    explains hangs together through a run and gives it more, told from the squares of its sums over
    each run (as robust standard errors are of clustered data; White 1982, doi:10.2307/1912526). By
    that ratio the difference is shortened. So two causes are told apart only where they part by
    more than what neither explains.
    """
    dearer = one.cost - best.cost - refits.misjudged
    if refits.misjudged > 0:
        dearer = min(dearer, one.fit.cost - best.fit.cost)
    return max(dearer, 0.0) / _scatter(one, best)


def _scatter(one: Hypothesis, best: Hypothesis) -> float:
    return widened(best.near.unexplained(best.causes), one.near.unexplained(one.causes))


def widened(left: Residuals, other: Residuals) -> float:
    """Return how much wider two costs' difference scatters than by noise, a variance ratio >= 1.

    Args:
        left: what the better one leaves by run, (m_k,) each.
        other: what the other leaves.
    """
    parts = [(here, there - here) for here, there in zip(left, other, strict=True)]
    noise = sum(float(d @ d) for _, d in parts)
    chance = sum(float(here @ d) ** 2 for here, d in parts)
    return max(chance / max(noise, 1e-12), 1.0)


def believable(gained: float, scatter: float, runs: int) -> float:
    """Return what a gain is worth where some of its scatter is told from a few runs.

    Noise is known; the rest is not, and five runs may agree by chance. So the gain has Student's
    distribution, with degrees of freedom by Satterthwaite (Biometrics Bulletin 2, 1946,
    doi:10.2307/3002019), and counts as one that is as rare where all scatter is known.

    Args:
        gained: of the cost, shortened by the scatter.
        scatter: variance of the gain over that by noise, 1 or more.
        runs: that told it.
    """
    if gained <= 0 or scatter <= 1:
        return gained
    freedom = max(runs - 1, 1) * (scatter / (scatter - 1)) ** 2
    chance = float(scipy.stats.t.sf((2 * gained) ** 0.5, freedom))
    return min(float(scipy.stats.norm.isf(chance)) ** 2 / 2, gained) if chance > 0 else gained


def _weights(
    refits: Refits, best: Hypothesis, likely: list[Hypothesis], same: Sequence[Hypothesis]
) -> dict[str, float]:
    """Return the share of each likely cause in some, weighed by how far they are behind."""
    weights = scipy.special.softmax([-_behind(refits, one, best) for one in same])
    found: dict[str, float] = {}
    for one, weight in zip(same, weights, strict=True):
        for name in one.causes if one in likely else ():
            found[name] = found.get(name, 0.0) + float(weight)
    return found


def _without_cause(refits: Refits) -> Answer:
    base = refits.base
    if refits.far or left_over(refits, base.beyond):
        left = base.left if refits.far else base.beyond
        reason = (
            f"{left:.2f} noise deviations of the misfit hang together in time, and no known "
            "cause explains them"
        )
        return Answer("NONE", (), base, {}, _named(refits), reason)
    reason = (
        f"nothing is left above the noise ({base.left:.2f} noise deviations hang together); no "
        "cause is worth its name"
    )
    return Answer("CLEAN", (), base, {}, _named(refits), reason)


def negligible(refits: Refits) -> float:
    """Return how many noise deviations may be left by what has no practical size, and by chance."""
    return float((NOTHING_LEFT**2 + SURE * refits.doubt) ** 0.5)


def left_over(refits: Refits, left: float) -> bool:
    """Tell whether more is left than that."""
    return left > negligible(refits)


def _named(refits: Refits) -> tuple[Rival, ...]:
    return tuple(
        Rival(score.causes[0], f"would explain {score.size:.2f} noise deviations, worth "
              f"{score.worth:.1f} of {LEAST_WORTH:g}")
        for score in refits.scores[:3] if score.worth > 1
    )  # fmt: skip


def _rivals(
    refits: Refits, layout: Layout, best: Hypothesis, causes: tuple[str, ...]
) -> tuple[Rival, ...]:
    """Return what was not taken, with the reason in words."""
    found: dict[str, Rival] = {}
    for one in refits.singles:
        name = one.causes[0]
        if name not in causes:
            found[name] = Rival(
                name, f"alone it leaves {one.left:.2f} noise deviations unexplained where "
                f"{' with '.join(best.causes)} leaves {best.left:.2f}",
            )  # fmt: skip
    for score in refits.scores:
        name = score.causes[0]
        if name not in causes and name not in found and score.worth > 0.02 * refits.worth(best):
            found[name] = Rival(
                name, f"could explain {score.size:.2f} of {best.size:.2f} noise deviations at most"
            )
    for name in refits.base.near.silent:
        found[name] = Rival(name, "these runs do not excite it: " + _shows(layout, name))
    return tuple(found.values())


def _shows(layout: Layout, name: str) -> str:
    modes = layout.causes[name].shows_in
    return f"it shows in {', '.join(modes)}" if modes else "it shows nowhere in them"
