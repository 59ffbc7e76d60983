"""What the observer says of the candidates: promised, fitted, weighed, decided."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from workbench.diagnose.decide import Part, Scored, Shown, chosen, comparable, decide
from workbench.diagnose.findings import Cause, EstimatedQuantity, Refit, quantity_of
from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis, by_cost
from workbench.diagnose.screening import Promise
from workbench.diagnose.wording import together
from workbench.fit import LIMITS
from workbench.progress import Stage

__all__ = ["ObserverPart", "Shortlist", "observer_part", "practical", "shortlisted"]


@dataclass(frozen=True, eq=False)
class ObserverPart:
    """What the observer says.

    Args:
        part: of the answer.
        causes: that it lists.
        base: without causes.
        best: the hypothesis that holds; the base where none does.
        tried: all that were fitted.
        promises: of each candidate, seen from the base.
        refit: what the fit changed of the model's own numbers.
        fits: that said it.
    """

    part: Part
    causes: tuple[Cause, ...]
    base: Hypothesis
    best: Hypothesis
    tried: tuple[Hypothesis, ...]
    promises: tuple[Promise, ...]
    refit: tuple[Refit, ...]
    fits: Fits

    @property
    def leader(self) -> Hypothesis:
        """Return what holds, or is likeliest where something is missing; else the base."""
        if self.best.names or self.part.kind == "CLEAN":
            return self.best
        return min((self.base, *self.tried), key=by_cost)

    @property
    def compared(self) -> Hypothesis:
        """Return the best as it was compared, before it was fitted to its end."""
        tried = (one for one in self.tried if one.names == self.best.names)
        return next(tried, self.base)


@dataclass(frozen=True, eq=False)
class Shortlist:
    """Causes that promise most, each fitted alone.

    Args:
        base: without causes.
        promises: of each candidate, seen from the base, most first.
        singles: hypotheses of one cause each, in their order.
        hidden: whether the base asks for process noise that hides what a cause would do.
    """

    base: Hypothesis
    promises: tuple[Promise, ...]
    singles: tuple[Hypothesis, ...]
    hidden: bool

    @property
    def leader(self) -> Hypothesis:
        """Return the likeliest; the base where nothing is."""
        return min((self.base, *self.singles), key=by_cost)


def shortlisted(fits: Fits, base: Hypothesis) -> Shortlist:
    """Fit the causes that promise most.

    Where something is hidden, those of another machine are fitted by the whole recipe, until one
    leaves no more than a whole model may.
    """
    rules, progress = fits.rules, fits.progress
    progress(Stage("see what each candidate promises", 0.0))
    promises = fits.promises(base)
    most = promises[0].gain if promises else 0.0
    hidden = fits.missing(base) > 1
    share = rules.promising * most
    least = {one.name: share if hidden else max(share, fits.little(one.name)) for one in promises}
    unlike = [one for one in promises if hidden and fits.candidates[one.name].unlike]
    near = [one for one in promises if one not in unlike and one.gain >= least[one.name]]
    short = near[: rules.shortlist]
    singles: list[Hypothesis] = []
    for number, one in enumerate(short):
        progress(Stage(f"fit {one.name}", 0.15 + 0.45 * number / len(short)))
        if (single := fits.refit((one.name,), base, one)) is not None:
            singles.append(single)
    for one in unlike:
        if fits.missing(min(singles, key=by_cost, default=base)) > 1:
            progress(f"fit {one.name}")
            if (single := fits.refit((one.name,), base, one)) is not None:
                singles.append(single)
    return Shortlist(base, tuple(promises), tuple(singles), hidden)


def observer_part(fits: Fits, listed: Shortlist) -> ObserverPart:
    """Return what the observer says of the candidates."""
    base, promises, progress = listed.base, listed.promises, fits.progress
    before = {one.names: one for one in listed.singles}
    singles = _weighed(fits, base, listed.singles, listed.hidden)
    pairs: list[Hypothesis] = []
    if singles and _asks_for_more(fits, base, singles[0], listed.hidden):
        first = singles[0]
        least = fits.rules.promised * (base.cost - first.cost)
        pairs = _weighed(fits, first, _beside(fits, first, 0.6))
        for names, one in fits.pairs_without(first.names[0], base, promises):
            if one.gain < least:
                continue
            progress(f"fit {together(names)}")
            if (pair := fits.refit(names, base, one)) is None:
                continue
            better = pair.cost < before[first.names].cost  # at the base's process noise
            pairs.append(fits.weighed(pair) if better else pair)
    base, tried = _from_best(fits, base, [*singles, *pairs])
    progress(Stage("judge by the runs held out", 0.9))
    tried, part = _decided(fits, base, tried)
    fits.progress("fit what holds to its end")
    alike = {part.best.names, *(one.names for one in part.alike)}
    ended = {one.names: fits.ended(one) for one in (base, *tried) if one.names in alike}
    best = ended[part.best.names]
    holders = {name: ended[one.names] for one in reversed(part.alike) for name in one.names}
    names = dict.fromkeys(name for one in part.alike for name in one.names)
    errors = {one: fits.errors(one, holders) for one in {best, *holders.values()}}
    causes = [_cause(name, holders[name], errors[holders[name]], fits) for name in names]
    refit = _refit(fits, best, errors[best])
    return ObserverPart(part, tuple(causes), base, best, tuple(tried), promises, refit, fits)


def _from_best(
    fits: Fits, base: Hypothesis, tried: Sequence[Hypothesis]
) -> tuple[Hypothesis, list[Hypothesis]]:
    """Return the base and what was tried; all within the best fitted from there as well.

    Else a gain may be a minimum that was found by chance, and no cause: of 511 that two causes
    gained in a null, the base alone gained 209 from where they ended.
    """
    best = min(tried, key=by_cost, default=base)
    if base.cost - best.cost < fits.rules.least_gain:
        return base, list(tried)
    fits.progress(f"fit the others from where {together(best.names)} ended")
    within = [one for one in tried if set(one.names) < set(best.names)]
    again = {one.names: fits.again(one, best) for one in (base, *within)}
    return again[()], [again.get(one.names, one) for one in tried]


def _decided(
    fits: Fits, base: Hypothesis, tried: Sequence[Hypothesis]
) -> tuple[list[Hypothesis], Part]:
    """Return what was tried in the end, and what is decided.

    Where two causes hold together a third is looked for beside them, and so on: a machine with
    three joints has friction in each. Where elements share a number, they are also given one each.
    """
    given, tried = (fits.samples() / fits.repeats(), fits.rules), list(tried)
    before, scored = _scored(fits, base), [_scored(fits, one) for one in tried]
    count, apart = 1, set[tuple[str, ...]]()
    while True:
        _, best = chosen(*comparable(before, scored, fits.rules), *given)
        at = next((one for one in tried if one.names == best.names), base)
        more = [] if best.names in apart else _apart(fits, at)
        apart.add(best.names)
        if len(best.names) > count:
            count = len(best.names)
            gain = fits.rules.promising * (base.cost - at.cost)
            more += _weighed(fits, at, _beside(fits, at, least=fits.rules.promised * gain))
        if not more:
            return tried, decide(before, scored, *given)
        tried += more
        scored += [_scored(fits, one) for one in more]


def _apart(fits: Fits, at: Hypothesis) -> list[Hypothesis]:
    """Return a hypothesis for each shared number, with a number for each element instead."""
    found = []
    for name in at.names:
        parts = fits.candidates.parts(name)
        if not parts:
            continue
        others = (one for one in at.names if one != name)
        names = (*others, *(one.name for one in parts))
        fits.progress(f"fit {together(names)}")
        shared = next(iter(fits.candidates[name].quantities.values()))
        more = at.values[shared.name] - shared.nominal
        start = {p.name: p.nominal + more for one in parts for p in one.quantities.values()}
        found.append(fits.whole(names, at.values | start))
    return found


def _beside(
    fits: Fits, first: Hypothesis, begun: float | None = None, least: float = 0.0
) -> list[Hypothesis]:
    """Return a hypothesis with one more cause each, those that promise most beside it."""
    words, rules = together(first.names), fits.rules
    fits.progress(Stage(f"see what each candidate promises beside {words}", begun))
    least = max(least, rules.least_gain)
    added = [one for one in fits.promises(first) if one.gain > least][: rules.seconds]
    found = []
    for number, one in enumerate(added):
        share = None if begun is None else begun + (0.9 - begun) * number / len(added)
        fits.progress(Stage(f"fit {together((*first.names, one.name))}", share))
        if (more := fits.refit((*first.names, one.name), first, one)) is not None:
            found.append(more)
    return found


def _asks_for_more(fits: Fits, base: Hypothesis, leader: Hypothesis, hidden: bool) -> bool:
    """Return whether a second cause is looked for beside the leading one.

    Beside what is there, or nearly of a practical size, or where something is missing: hops gain 20
    to 50 by chance wherever a fit of them begins, and each pair of them takes half a minute.
    """
    rules, gain = fits.rules, base.cost - leader.cost
    nearly = 0.0 if hidden else rules.near * practical(fits, leader)
    return gain / fits.repeats() > max(rules.least_gain, nearly)


def practical(fits: Fits, one: Hypothesis) -> float:
    """Return the gain over the base that is of a practical size, or no chance of numbers freed."""
    if all(fits.candidates.frees(name) for name in one.names):
        return fits.rules.no_chance(fits.candidates.numbers(one.names))
    samples = fits.samples(one.names) / fits.repeats()
    return fits.rules.practical(samples, fits.candidates.numbers(one.names))


def _weighed(
    fits: Fits, base: Hypothesis, found: Sequence[Hypothesis], hidden: bool = False
) -> list[Hypothesis]:
    """Return hypotheses, best first; the process noise of those that lead is weighed anew."""
    if not found:
        return []
    gain = max(base.cost - one.cost for one in found)
    if hidden:
        found = [fits.likelier(fits.weighed(one)) for one in found]
    elif gain > fits.rules.suspected:
        least = gain - max((1 - fits.rules.near) * gain, fits.rules.least_gain)
        found = [fits.weighed(one) if base.cost - one.cost > least else one for one in found]
    return sorted(found, key=by_cost)


def _scored(fits: Fits, one: Hypothesis) -> Scored:
    return replace(_at(fits, one, one), again=lambda: _at(fits, one, fits.limited(one)))


def _at(fits: Fits, one: Hypothesis, at: Hypothesis) -> Scored:
    """Return a hypothesis as it was fitted at some process noise; what it misses stays its own."""
    names, candidates = at.estimator.system.names, fits.candidates
    by_run = {name: float(run.sum()) for name, run in zip(names, at.blocks, strict=True)}
    return Scored(
        one.names, at.prior, np.concatenate(at.blocks), fits.judged(at),
        partial(fits.missing, one), by_run,
        frozenset(name for name in one.names if candidates.frees(name)),
        candidates.numbers(one.names), candidates.shared(one.names),
        {name: _shown(fits, name) for name in one.names},
    ).over(fits.repeats())  # fmt: skip


def _shown(fits: Fits, name: str) -> Shown:
    return Shown(
        fits.samples([name]) / fits.repeats(), tuple(fits.shows(run, [name]) for run in fits.held)
    )


def _cause(name: str, holder: Hypothesis, errors: Mapping[str, float], fits: Fits) -> Cause:
    """Return a candidate with what was found of its quantities, or of the numbers that it frees."""
    candidate, values = fits.candidates[name], holder.values
    quantities = dict[str, EstimatedQuantity]()
    for key, parameter in candidate.quantities.items():
        value, error = values[parameter.name], errors[parameter.name]
        quantities[key] = quantity_of(value, error, parameter.low, parameter.high, parameter.unit)
    if candidate.frees:
        stated = {p.name: p.nominal for p in fits.rig.base}
        key, unit = candidate.freed
        scales = [stated[name] if unit == "1" else 1.0 for name in candidate.frees]
        pairs = list(zip(candidate.frees, scales, strict=True))
        more = float(np.mean([(values[name] - stated[name]) / scale for name, scale in pairs]))
        error = float(np.mean([errors[name] / scale for name, scale in pairs]))
        quantities[key] = quantity_of(more, error, -np.inf, np.inf, unit)
    sentence = candidate.sentence.format_map(quantities)
    return Cause(candidate.name, quantities, sentence, candidate.separated_by)


def _refit(fits: Fits, best: Hypothesis, errors: Mapping[str, float]) -> tuple[Refit, ...]:
    """Return what the fit changed of the model's own numbers."""
    values, changed = best.values, list[Refit]()
    for p in fits.rig.base:
        now = quantity_of(values[p.name], errors[p.name], -np.inf, np.inf, p.unit)
        share = (now.value - p.nominal) / (LIMITS * p.deviation)
        changed.append(Refit(p.name, p.nominal, now.value, now.low, now.high, p.unit, share))
    return tuple(changed)
