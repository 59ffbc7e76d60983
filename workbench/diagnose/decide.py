"""From fitted hypotheses to an answer.

The runs' seconds vote: where one model is likelier than another, the gain is a sum over seconds of
runs fitted and held out, and its scatter from second to second says how sure it is, whatever both
models miss (Vuong, Econometrica 57, 1989, 307). A cause is there where its gain over the base is no
chance, of a practical size, sure, and confirmed by runs that no fit has seen. It is named where the
same seconds prefer it to every other; those that are not behind are a set with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.rules import Rules
from workbench.diagnose.wording import digits, together

__all__ = ["Kind", "Part", "Scored", "Shown", "Versus", "chosen", "comparable", "decide",
           "versus"]  # fmt: skip

Array = NDArray[np.float64]
Kind = Literal["NAMED", "SET", "PARTIAL", "NONE", "CLEAN", "DATA_FAULT"]


class Shown(NamedTuple):
    """What can show a cause: a foot that is held shows nothing of the floor.

    Args:
        samples: of the fitted runs that can, of all channels.
        held: which of the runs held out can.
    """

    samples: float
    held: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Scored:
    """A hypothesis as an answer sees it.

    Args:
        names: of its causes; none is the base.
        prior: part of the cost that is no run's.
        blocks: (b,) cost of each second of the fitted runs [1].
        held: (b,) of each run held out, the cost of its seconds [1].
        misses: returns how much less likely the runs are if nothing is missing, over what counts;
            it is asked of few, for it takes a fit.
        by_run: fitted run -> its cost.
        frees: names of its causes that free numbers of the model.
        numbers: that its causes release.
        shared: names of causes that are within it: one number where it has one for each element.
        shown: cause -> what can show it; all runs where left out.
        again: returns the same at the process noise that a whole model may have, by another fit.
    """

    names: tuple[str, ...]
    prior: float
    blocks: Array
    held: tuple[Array, ...]
    misses: Callable[[], float]
    by_run: Mapping[str, float] = field(default_factory=dict)
    frees: frozenset[str] = frozenset()
    numbers: int = 1
    shared: frozenset[str] = frozenset()
    shown: Mapping[str, Shown] = field(default_factory=dict)
    again: Callable[[], Scored] | None = None

    @property
    def missing(self) -> float:
        """Return how much less likely the runs are if nothing is missing, over what counts."""
        return self.misses()

    @property
    def limited(self) -> Scored:
        """Return the same at the process noise that a whole model may have."""
        return self if self.again is None else self.again()

    @property
    def cost(self) -> float:
        """Return the cost of the fitted runs."""
        return self.prior + float(self.blocks.sum())

    def over(self, repeats: float) -> Scored:
        """Return the same where innovations repeat one another so often: all runs count less."""
        by_run = {run: cost / repeats for run, cost in self.by_run.items()}
        held = tuple(one / repeats for one in self.held)
        return replace(self, blocks=self.blocks / repeats, held=held, by_run=by_run)


@dataclass(frozen=True)
class Versus:
    """How much likelier one hypothesis makes the runs than another.

    Args:
        gain: of the cost, fitted runs.
        held: of the cost, runs held out.
        sure: both over their scatter from second to second.
        runs: share that prefer it of the runs held out that can show the difference.
    """

    gain: float
    held: float
    sure: float
    runs: float


def versus(one: Scored, other: Scored) -> Versus:
    """Compare a hypothesis with another.

    Args:
        one: whose gain is returned.
        other: that it is compared with.
    """
    fitted = other.blocks - one.blocks
    held = [b - a for a, b in zip(one.held, other.held, strict=True)]
    every = np.concatenate([fitted, *held])
    scatter = float(np.std(every)) * np.sqrt(len(every))
    runs = [float(part.sum()) for part in held]
    shown, differ = {**other.shown, **one.shown}, {*one.names} ^ {*other.names}
    can = [
        any(name not in shown or shown[name].held[k] for name in differ) for k in range(len(runs))
    ]
    votes = [gain > 0 for gain, shows in zip(runs, can, strict=True) if shows]
    prior = other.prior - one.prior
    return Versus(
        float(fitted.sum()) + prior,
        sum(runs),
        (float(every.sum()) + prior) / max(scatter, 1e-9),
        float(np.mean(votes)) if votes else float(not runs),
    )


@dataclass(frozen=True, eq=False)
class Part:
    """What one kind of evidence says: that of the observer, or that of the rotor's angle.

    Args:
        kind: NAMED, SET, PARTIAL, NONE or CLEAN.
        best: the hypothesis that holds; the base where none does.
        alike: hypotheses that explain the same, the best first.
        missing: what `Scored.misses` returns of the best.
        explained: share of what is missing that the best explains.
        reason: in a sentence.
        compared: of every hypothesis with the base, best first.
    """

    kind: Kind
    best: Scored
    alike: tuple[Scored, ...]
    missing: float
    explained: float
    reason: str
    compared: tuple[tuple[Scored, Versus], ...]


def decide(base: Scored, tried: Sequence[Scored], samples: float, rules: Rules) -> Part:
    """Return what hypotheses say together.

    Args:
        base: without causes.
        tried: with causes.
        samples: that the fitted runs have, of all channels.
        rules: of the diagnosis.
    """
    base, tried = comparable(base, tried, rules)
    found = sorted(((one, versus(one, base)) for one in tried), key=lambda pair: -pair[1].gain)
    compared = tuple(found)
    before, best = chosen(base, tried, samples, rules)
    if best is base:
        return _without(base, compared, samples, rules)
    if best.missing > 1 and _explained(best, base) < rules.material:
        reason = f"{_missing_words(base.missing)}, and no known cause explains it; "
        reason += f"{together(best.names)} would explain {100 * _explained(best, base):.0f} %"
        return Part("NONE", base, (), base.missing, 0.0, reason, compared)
    likelier = [
        one
        for one, gained in compared
        if gained.gain > rules.suspected
        and (gained.held > -rules.suspected or _behind(best, one, rules))
    ]
    alike, beside = _alike(best, likelier, rules), ""
    if len(alike) > 1 and before.missing <= 1 and _share(alike, before):
        others = [name for one in alike for name in one.names if name not in before.names]
        beside = f"; beside it {' or '.join(others)}, which these runs cannot separate"
        best, alike = before, (before,)
    words, explained = together(best.names), _explained(best, base)
    alone = _influential_run(best, base, rules)
    kind: Kind
    if not _leaves_little(best, base, rules):
        which = words if len(alike) == 1 else f"{words} or another like it"
        left = f"{100 * explained:.0f} % of what the model misses, not the rest"
        kind, reason = "PARTIAL", f"{which} explains {left}"
    elif len(alike) > 1:
        names = ", ".join(dict.fromkeys(name for one in alike for name in one.names))
        kind, reason = "SET", f"{names} cannot be separated by these runs"
    elif alone is not None:
        kind = "SET"
        reason = f"{words} may be there, but {alone} alone supports it; repeat that run"
    else:
        kind = "NAMED"
        reason = f"{words}: every other cause leaves clearly more unexplained, in runs held out as "
        reason += f"well{beside}"
        if best.missing > 1:
            reason += f"; with it {_missing_words(best.missing)} still"
    return Part(kind, best, alike, best.missing, explained, reason, compared)


def comparable(base: Scored, tried: Sequence[Scored], rules: Rules) -> tuple[Scored, list[Scored]]:
    """Return the base and what was tried, as they are to be compared.

    Process noise that a base asks for follows whatever it misses, and a cause of that gains little
    beside it. So where something is missing, and a cause that gains about as much as any leaves
    little of it, all are compared at the process noise of a whole model.

    Args:
        base: without causes.
        tried: with causes.
        rules: of the diagnosis.
    """
    gains = {one.names: versus(one, base).gain for one in tried}
    most = max(gains.values(), default=0.0)
    leading = [one for one in tried if gains[one.names] > max(rules.near * most, rules.least_gain)]
    if base.missing <= 1 or not any(_leaves_little(one, base, rules) for one in leading):
        return base, list(tried)
    return base.limited, [one.limited for one in tried]


def chosen(
    base: Scored, tried: Sequence[Scored], samples: float, rules: Rules
) -> tuple[Scored, Scored]:
    """Return the best of all that hold, and that of one cause less; the base where none does.

    Of every number of causes it is the likeliest that holds beside those before, or in their place.
    A third and those after it must also gain a share of what those before gain together: a fine
    sensor sees every trifle.

    Args:
        base: without causes.
        tried: with causes.
        samples: that the fitted runs have, of all channels.
        rules: of the diagnosis.
    """
    before = best = base
    ended = [one for one in tried if not _ended_early(one, tried)]
    found = sorted(ended, key=lambda one: -versus(one, base).gain)
    for count in range(1, max((len(one.names) for one in found), default=0) + 1):
        for one in (one for one in found if len(one.names) == count):
            if set(best.names) < set(one.names):
                holds = len(best.names) == count - 1 and _holds(one, best, samples, rules)
                holds = holds and (count < 3 or _matters(one, best, base, rules))
            elif _within(best, one):
                holds = _holds(one, best, samples, rules)
            else:  # other causes in their place
                holds = _holds(one, base, samples, rules)
                holds = holds and _behind(best, one, rules)
            if holds:
                before, best = best, one
                break
    return before, best


def _ended_early(one: Scored, others: Sequence[Scored]) -> bool:
    """Return whether a hypothesis is less likely than a case of its own: its fit is no minimum."""
    return any(set(other.names) < set(one.names) and other.cost < one.cost for other in others)


def _within(one: Scored, other: Scored) -> bool:
    """Return whether a hypothesis is a case of another, which has more numbers."""
    return set(one.names) <= {*other.names, *other.shared}


def _explained(one: Scored, base: Scored) -> float:
    """Return the share of what the base misses that a hypothesis explains."""
    return 1 - one.missing / base.missing if base.missing > one.missing else 0.0


def _leaves_little(one: Scored, simpler: Scored, rules: Rules) -> bool:
    """Return whether a hypothesis leaves what a whole model may miss, or explains most of it."""
    return one.missing <= 1 or _explained(one, simpler) >= rules.explained


def _holds(one: Scored, simpler: Scored, samples: float, rules: Rules) -> bool:
    """Return whether a hypothesis is more than chance, of a practical size, sure and confirmed.

    A number beyond its tolerance is of a practical size. What speaks for it is its prior where
    others can do the same to the motion only far beyond theirs; runs held out add nothing to that.
    Where something is missing, of which the hypothesis leaves little, there is a cause. It is held
    to what may be there: that its gain is no chance of a few seconds, and that no run refuses it.
    """
    found, added = versus(one, simpler), {*one.names} - {*simpler.names}
    numbers = max(one.numbers - (simpler.numbers if simpler.names else 0), 1)
    allowed = found.held > -rules.suspected
    if added <= one.frees:
        return found.gain > rules.no_chance(numbers) and allowed and found.sure > rules.sure
    if found.gain <= rules.practical(_samples(one, added, samples), numbers):
        return False
    confirmed = found.held > 0 and found.runs >= rules.agree
    if found.sure > rules.sure and confirmed:
        return True
    if found.sure < rules.apart or not allowed or simpler.missing <= 1:
        return False
    return _leaves_little(one, simpler, rules)


def _samples(one: Scored, names: Iterable[str], samples: float) -> float:
    """Return how many samples of all can show one of some causes."""
    return max(one.shown[k].samples if k in one.shown else samples for k in names)


def _matters(one: Scored, best: Scored, base: Scored, rules: Rules) -> bool:
    """Return whether a cause more gains a share of what those before it gain."""
    gained, more = versus(best, base).gain, versus(one, best).gain
    return more > rules.promising * gained


def _behind(one: Scored, other: Scored, rules: Rules) -> bool:
    """Return whether the same seconds put a hypothesis surely behind another."""
    found = versus(other, one)
    return found.sure >= rules.apart and found.gain + found.held >= rules.suspected


def _share(alike: Sequence[Scored], before: Scored) -> bool:
    """Return whether hypotheses that are alike have all of some causes, and differ in one more."""
    count = len(before.names) + 1
    return count > 1 and all(
        len(one.names) == count and set(before.names) < set(one.names) for one in alike
    )


def _influential_run(one: Scored, base: Scored, rules: Rules) -> str | None:
    """Return the run without which all others, held out as well, do not speak for a hypothesis."""
    gains = {run: base.by_run[run] - cost for run, cost in one.by_run.items()}
    whole = sum(gains.values()) + base.prior - one.prior + versus(one, base).held
    carried = [run for run, gain in gains.items() if whole - gain < rules.suspected]
    return carried[0] if carried and len(gains) > 1 else None


def _alike(best: Scored, tried: Sequence[Scored], rules: Rules) -> tuple[Scored, ...]:
    """Return the hypotheses that the same seconds do not put behind the best.

    Those of as many causes; beside a single one also pairs without it that are likelier.
    """
    found = [best]
    for one in tried:
        if one.names == best.names or len(one.names) < len(best.names):
            continue
        ahead = versus(one, best)
        if len(one.names) > len(best.names) and (
            _within(best, one) or ahead.gain + ahead.held < rules.suspected
        ):
            continue
        if not _behind(one, best, rules):
            found.append(one)
    return tuple(found)


def _without(
    base: Scored, compared: tuple[tuple[Scored, Versus], ...], samples: float, rules: Rules
) -> Part:
    suspects = [
        (one, found)
        for one, found in compared
        if len(one.names) == 1
        and found.gain > rules.maybe(one.numbers)
        and found.gain > rules.size * _samples(one, one.names, samples)
        and found.sure > rules.apart
        and found.held > -rules.suspected
    ]
    left = base.missing
    if suspects and left <= 1:
        alike = tuple(one for one, _ in suspects)
        reason = f"{', '.join(one.names[0] for one in alike)} may be there, but "
        reason += (
            "the runs held out do not confirm it"
            if base.held
            else "no run that could confirm it is held out"
        )
        return Part("SET", alike[0], alike, left, 0.0, reason, compared)
    if left > 1:
        reason = f"{_missing_words(left)}, and no known cause explains it"
        return Part("NONE", base, (), left, 0.0, reason, compared)
    reason = "nothing is missing above what the noise accounts for"
    return Part("CLEAN", base, (), left, 0.0, reason, compared)


def _missing_words(missing: float) -> str:
    return f"the model misses {digits(missing)} times what a whole one may"
