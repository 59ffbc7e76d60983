"""Whether a cause rests on one run: each run is left out in turn, by algebra on what was fitted.

A cause that is in the robot shows in every run that excites it. What one run alone carries is
another thing: where the other runs exclude it, that run is at fault; where they say nothing of it,
nobody knows yet. Nothing is simulated: the neighbourhood of the fit is kept by run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from workbench.diagnose.answer import Answer, Rival, left_over, widened
from workbench.diagnose.hypotheses import Refits
from workbench.diagnose.judging import Hypothesis, left_together
from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood

__all__ = ["Carrier", "carriers", "with_carriers"]

_MOST_ELSEWHERE = 0.5  # of what is left, squared: less of it, and one run raises a suspicion
_BELIEVED = 6.0  # worth: the other runs alone would have shown such a cause
_LEAST_OTHERS = 2  # runs that are left must be able to speak
_CONFIRMED = 0.01  # chance by which runs without a cause would speak for it so much
_TOLD = 1e-6  # of the variance: what a run adds less to, the difference says nothing of
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
        confirmed: worth by which the others alone would confirm it. They are asked of this one
            cause, not of the best of thirty, so it is less than what names a cause.
    """

    cause: str
    run: int
    worth: float
    without: float
    excluded: bool
    confirmed: float


def carriers(best: Hypothesis) -> list[Carrier]:
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
        if worth > _BELIEVED > left[run]:
            excluded = _excludes(others[run], best, cause)
            confirmed = (
                float(scipy.stats.chi2.isf(_CONFIRMED, len(best.near.layout.of_cause[cause]))) / 2
            )
            found.append(Carrier(cause, run, worth, left[run], excluded, confirmed))
    return found


def _without(near: Neighbourhood, run: int) -> Neighbourhood:
    """Return the same neighbourhood as seen by all other runs."""
    chosen = near.linear.without(run)
    share = sum(map(len, chosen.residuals)) / sum(map(len, near.linear.residuals))
    return Neighbourhood(near.layout, chosen, round(share * near.samples))


def _worth(near: Neighbourhood, rest: tuple[str, ...], causes: tuple[str, ...]) -> float:
    return near.lowest(rest) - near.lowest(causes)


def _excludes(others: Neighbourhood, best: Hypothesis, cause: str) -> bool:
    """Tell whether what the other runs find of a cause cannot be what all runs find.

    All runs are the others and one more, so the variance of the difference is the difference of
    the variances (Hausman, Econometrica 46, 1978). What the others leave unexplained widens
    both.
    """
    layout, causes = others.layout, best.causes
    if cause not in others.heard:
        return False
    own = layout.of_cause[cause]
    apart = others.score(causes).z[own] - best.near.score(causes).z[own]
    at = np.flatnonzero(np.isin(layout.quantities(causes), own))
    alone = others.spread(causes)[np.ix_(at, at)]
    values, axes = np.linalg.eigh(alone - best.near.spread(causes)[np.ix_(at, at)])
    told = values > _TOLD * np.trace(alone)
    distance = float(np.sum((axes.T @ apart)[told] ** 2 / values[told]))
    rest = tuple(name for name in causes if name != cause)
    wider = widened(others.unexplained(causes), others.unexplained(rest))
    return bool(distance / wider > scipy.stats.chi2.isf(_EXCLUDED, max(int(told.sum()), 1)))


def with_carriers(answer: Answer, refits: Refits, problem: Problem) -> Answer:
    """Return an answer that names no cause which rests on one run.

    Where the other runs exclude the cause, the data of that run are at fault and the cause is none
    of the robot's. Where they do not confirm it, it is one of a set: it may be there. Where they
    do, but would not have suspected it, it keeps its name with less weight.
    """
    if answer.kind == "NONE":
        return _with_source(answer, refits, problem)
    if answer.kind == "SET" and refits.worth(answer.best) <= _BELIEVED:
        return _unless_of_one_run(answer, refits, problem)
    found = carriers(answer.best)
    if not found:
        return answer
    excluded = [one for one in found if one.excluded]
    if excluded:
        return _at_fault(answer, refits, excluded, problem)
    weights = dict(answer.weights)
    for one in found:
        share = float(scipy.special.expit(one.without - one.confirmed))
        rivals = weights if len(answer.best.causes) == 1 else (one.cause,)
        weights |= {name: share * weights[name] for name in rivals}
    unsure = any(one.without < one.confirmed for one in found)
    return replace(
        answer, kind="SET" if unsure else answer.kind, weights=weights,
        reason=f"{answer.reason}; but {_told(found, problem)}. Repeat that run, or make one like "
        "it, to be sure",
    )  # fmt: skip


def _told(found: Sequence[Carrier], problem: Problem) -> str:
    return "; ".join(
        f"{one.cause} rests on {problem.rig.runs[one.run].name} {_how_far(one)}: it is worth "
        f"{one.worth:.1f} with it and {one.without:.1f} without" for one in found
    )  # fmt: skip


def _how_far(one: Carrier) -> str:
    """Return in a word how far a cause rests on its run: the others may confirm it."""
    return "alone" if one.excluded or one.without < one.confirmed else "for the most part"


def _at_fault(
    answer: Answer, refits: Refits, excluded: Sequence[Carrier], problem: Problem
) -> Answer:
    """Return the fault of the runs that carry what all others exclude."""
    carried = {one.cause for one in excluded}
    rest = tuple(name for name in answer.best.causes if name not in carried)
    best = next((one for one in refits.singles if one.causes == rest), refits.base)
    names = dict.fromkeys(problem.rig.runs[one.run].name for one in excluded)
    rivals = tuple(
        Rival(one.cause, f"it rests on {problem.rig.runs[one.run].name} alone, and the other runs "
              "exclude it") for one in excluded
    )  # fmt: skip
    return Answer(
        "DATA_FAULT",
        best.causes,
        best,
        {name: answer.weights.get(name, 0.0) for name in best.causes},
        (*rivals, *answer.rivals),
        f"{_told(excluded, problem)}; the other runs exclude it, so the data of "
        f"{' and '.join(names)} are at fault. Leave it out, or find what was different in it",
    )


def _with_source(answer: Answer, refits: Refits, problem: Problem) -> Answer:
    """Return NONE with the run that all of what is left comes from, where it is one.

    Where a known cause is worth something in that run only and the others exclude it, the data of
    the run are at fault.
    """
    best = answer.best
    runs = best.fit.linear.runs
    if len(runs) <= _LEAST_OTHERS or not left_over(refits, best.beyond):
        return answer
    left = {}
    for k in runs:
        near = _without(best.near, k)
        left[k] = left_together(problem, near.linear.runs, near.unexplained(best.causes))
    run = min(left, key=lambda k: left[k])
    if left_over(refits, left[run]):
        return answer
    guess = carriers(refits.singles[0]) if refits.singles and not best.causes else []
    excluded = [one for one in guess if one.excluded and one.run == run]
    if excluded:
        return _at_fault(answer, refits, excluded, problem)
    return _found_in(answer, problem, run, left[run])


def _unless_of_one_run(answer: Answer, refits: Refits, problem: Problem) -> Answer:
    """Return a suspicion that what is left raises, or NONE where that is left of one run alone."""
    linear, before = refits.base.fit.linear, refits.base.left
    if len(linear.runs) <= _LEAST_OTHERS or not refits.suspicious(before):
        return answer
    left = {}
    for k in linear.runs:
        kept = [at for at, run in enumerate(linear.runs) if run != k]
        rest = [linear.residuals[at] for at in kept]
        left[k] = left_together(problem, [linear.runs[at] for at in kept], rest)
    run = min(left, key=lambda k: left[k])
    if refits.suspicious(left[run]) or left[run] ** 2 > _MOST_ELSEWHERE * before**2:
        return answer
    nothing = Answer(
        "NONE", (), refits.base, {}, answer.rivals,
        f"{before:.2f} noise deviations of the misfit hang together in time, and no cause is worth "
        "its name",
    )  # fmt: skip
    return _found_in(nothing, problem, run, left[run])


def _found_in(answer: Answer, problem: Problem, run: int, left: float) -> Answer:
    """Return an answer whose reason says in which run all of it is."""
    return replace(
        answer,
        reason=f"{answer.reason}. All of it is in {problem.rig.runs[run].name}: the other runs "
        f"leave {left:.2f}. Look at that run first, and repeat it",
    )
