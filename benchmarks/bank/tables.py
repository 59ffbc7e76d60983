"""The bank's page: every score beside its bar for each generator, and the confusion matrix."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.bank.one_case import Line
from benchmarks.bank.resolving import ROUNDS, rounds_of, wrongly
from benchmarks.bank.score import BARS, Judged, Score, confusion, counted, covered, scores

__all__ = ["Reported", "Turned", "page"]

_WITHIN = 2
_RESOLVED = {"twin": 0.80, "rod": 0.70}
_TIMES = 1.5
_SOURCES = {"twin": "the twin", "rod": "the independent engine"}
_COMPARED = (
    "top-1 name, size 3", "top-1 name, size 1", "named and wrong", "false alarm on nulls",
    "pairs: both named", "outside: named",
)  # fmt: skip


@dataclass(frozen=True)
class Turned:
    """Cases of an effect, answered with the twin as it is and with its sign turned.

    Args:
        effect: whose sign was turned.
        before: answers of the twin as it is.
        after: the same cases with the sign turned.
    """

    effect: str
    before: Sequence[Judged]
    after: Sequence[Judged]


@dataclass(frozen=True)
class Reported:
    """All that the page is made of.

    Args:
        judged: answers beside their labels.
        plain: name of a dumb engine -> its answers to the same cases.
        turned: sign-flip checks.
        ties: lines of `benchmarks.bank.resolving`.
        drawn: how many cases were drawn.
        failed: what became of those without an answer, one line each.
        seeds: of the draws.
        engines: state of the engine -> how many cases it answered.
        newest: cases among those judged that the engine answered as it is now.
        alike: states before it whose answers are its own, counted among them.
    """

    judged: Sequence[Judged]
    plain: Mapping[str, Sequence[Judged]]
    turned: Sequence[Turned]
    ties: Sequence[Line]
    drawn: int
    failed: Sequence[str]
    seeds: Sequence[int]
    engines: Mapping[str, int]
    newest: frozenset[int] = frozenset()
    alike: frozenset[str] = frozenset()


def page(reported: Reported) -> str:
    """Return the page in Markdown."""
    parts = [
        "# The bank of hidden-effect cases",
        "",
        f"Written by `make bank SEED=n`, seeds {_spans(reported.seeds)}: "
        f"{reported.drawn} cases drawn, {len(reported.judged)} judged"
        f"{_by(reported.engines)}{_reduced(reported.judged)}. "
        "What a case is and how it is scored: [the bank's own page](../decisions/0010-bank.md). "
        "Intervals are Wilson's at 90 %. Seconds are by the clock, with as many cases answered at "
        "once as there are cores. What limits it: "
        "[where the diagnosis ends](../explanation/diagnosis.md#where-it-ends).",
        "",
    ]
    newest = [one for one in reported.judged if one.label.get("seed") in reported.newest]
    if newest and len(newest) < len(reported.judged):
        parts += [f"## The engine as it is: {_cases(len(newest))}", "", *_also(reported.alike),
                  *_scored(newest), "",
                  f"## By all its states: {len(reported.judged)} cases", ""]  # fmt: skip
    parts += _scored(reported.judged)
    parts += _beside_plain(reported)
    parts += _signs(reported.turned)
    parts += _ties(reported.ties)
    parts += ["", "## What was said of what", "", "| truth | answers |", "|---|---|"]
    for truth, said in sorted(confusion(reported.judged).items()):
        words = ", ".join(f"{answer} {count}" for answer, count in said.most_common())
        parts.append(f"| {truth} | {words} |")
    if reported.failed:
        parts += ["", "## Cases without an answer", "", *(f"- {line}" for line in reported.failed)]
    return "\n".join(parts) + "\n"


def _scored(judged: Sequence[Judged]) -> list[str]:
    """Return every score beside its bars."""
    parts = ["| score | twin's cases | bar | independent engine's | bar |", "|---|---|---|---|---|"]
    columns = {source: scores(_of(judged, source)) for source in _SOURCES}
    for twin, rod in zip(columns["twin"], columns["rod"], strict=True):
        bar = BARS[twin.name]
        cells = [_cell(twin), _verdict(twin, bar.twin, bar.least, bar.most[0]), _cell(rod),
                 _verdict(rod, bar.rod, bar.least, bar.most[1])]  # fmt: skip
        parts.append(f"| {twin.name} | {' | '.join(cells)} |")
    return parts


def _also(alike: frozenset[str]) -> list[str]:
    """Return which states before are counted with the engine as it is, in words."""
    states = ", ".join(sorted(alike))
    return [f"With those by {states}, which answers alike.", ""] if alike else []


def _cases(count: int) -> str:
    return f"{count} case" if count == 1 else f"{count} cases"


def _by(engines: Mapping[str, int]) -> str:
    """Return by how many states of the engine, in words, where they are more than one."""
    return f" by {len(engines)} states of the engine" if len(engines) > 1 else ""


def _spans(numbers: Sequence[int]) -> str:
    """Return whole numbers in words, three or more in a row by the first and the last."""
    ordered = sorted(numbers)
    begins = [n for n in ordered if n - 1 not in numbers]
    ends = [n for n in ordered if n + 1 not in numbers]
    rows = zip(begins, ends, strict=True)
    words = [f"{a}" if a == b else f"{a}{' to ' if b > a + 1 else ', '}{b}" for a, b in rows]
    return ", ".join(words)


def _reduced(judged: Sequence[Judged]) -> str:
    """Return how many cases were reduced, and how many not sized, in words, where any was."""
    short = sum(bool(one.label.get("reduced")) for one in judged)
    hops = [one.label for one in judged if one.label.get("protocols") == "S+D+H" and one.truth]
    rough = sum("sizes" not in label for label in hops)
    words = (
        f"; {short} of them reduced to five runs of three seconds without a hop" if short else ""
    )
    return words + (
        f"; {rough} with causes of the given size within a factor of two" if rough else ""
    )


def _beside_plain(reported: Reported) -> list[str]:
    """Return the same scores of the dumb engines."""
    parts = [
        "",
        "## Beside dumb engines",
        "",
        "`single` names the cause that fits the training runs best, `bic` adds causes while the "
        "Bayesian information criterion falls, `sindy` names the largest term in the acceleration "
        "that the base leaves. All begin at the base fit of the real one.",
        "",
        f"| score | cases of | diagnose | {' | '.join(reported.plain)} |",
        f"|---|---|---|{'---|' * len(reported.plain)}",
    ]
    every = [reported.judged, *reported.plain.values()]
    by = {source: [_named(scores(_of(judged, source))) for judged in every] for source in _SOURCES}
    for name in _COMPARED:
        for source, words in _SOURCES.items():
            cells = [_cell(found[name]) for found in by[source]]
            parts.append(f"| {name} | {words} | {' | '.join(cells)} |")
    return parts


def _signs(turned: Sequence[Turned]) -> list[str]:
    """Return how the bank notices an effect whose sign is wrong."""
    if not turned:
        return []
    parts = [
        "",
        "## An effect with its sign turned",
        "",
        "The same cases, answered by a twin that has the effect the wrong way round: what is "
        "reported of its size must be wrong, or the bank could not tell.",
        "",
        "| effect | cases | right | right, turned | size within its interval | the same, turned |",
        "|---|---|---|---|---|---|",
    ]
    for one in turned:
        cells = [str(len(one.after)), _rights(one.before), _rights(one.after),
                 _sized(one.before, one.effect), _sized(one.after, one.effect)]  # fmt: skip
        parts.append(f"| {one.effect} | {' | '.join(cells)} |")
    return parts


def _rights(judged: Sequence[Judged]) -> str:
    return f"{sum(one.right for one in judged)} of {len(judged)}"


def _sized(judged: Sequence[Judged], effect: str) -> str:
    """Return how many named the effect with an interval that holds its true size."""
    holds = [all(covered(one, effect)) for one in judged if effect in one.causes]
    return f"{sum(holds)} of {len(judged)}"


def _ties(ties: Sequence[Line]) -> list[str]:
    """Return how soon ties were resolved by the runs that were proposed, and by any."""
    if not ties:
        return []
    parts = [
        "",
        "## Ties and the next experiment",
        "",
        "Constructed ties that were answered as a set. Runs are asked for, made and diagnosed with "
        f"all before, up to {ROUNDS} times, until one cause is named: those that the diagnosis "
        "proposes, and clamped runs and ring-downs at random that take as long. Of what was not "
        f"resolved, {ROUNDS + 1} rounds are counted.",
        "",
        "| cases of | resolved within 2 proposals | bar | named and wrong | rounds | at random "
        "| times as many | bar |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for source, words in _SOURCES.items():
        own = [one for one in ties if one["label"]["generator"] == source]
        soon = [rounds_of(one, "proposed") for one in own]
        late = [rounds_of(one, "random") for one in own]
        within = counted("within", sum(rounds <= _WITHIN for rounds in soon), len(own))
        wrong = counted("wrong", sum(wrongly(one, "proposed") for one in own), len(own))
        cells = [_cell(within), _verdict(within, _RESOLVED[source], True), _cell(wrong)]
        if own:
            times = sum(late) / sum(soon)
            verdict = "met" if times >= _TIMES else "missed"
            cells += [f"{sum(soon) / len(own):.2f}", f"{sum(late) / len(own):.2f}", f"{times:.2f}",
                      f"at least {_TIMES}, {verdict}"]  # fmt: skip
        else:
            cells += ["no case"] * 3 + [f"at least {_TIMES}"]
        parts.append(f"| {words} | {' | '.join(cells)} |")
    return parts


def _named(found: Sequence[Score]) -> dict[str, Score]:
    return {one.name: one for one in found}


def _of(judged: Sequence[Judged], source: str) -> list[Judged]:
    return [one for one in judged if one.label["generator"] == source]


def _cell(score: Score) -> str:
    if score.count == 0:
        return "no case"
    if score.hits is None:
        return f"{score.value:.3g} of {score.count}"
    low, high = score.interval90
    return f"{score.hits} of {score.count}: {score.value:.0%} ({low:.0%} to {high:.0%})"


def _verdict(score: Score, bar: float, least: bool, most: float = math.inf) -> str:
    asked = f"{'at least' if least else 'at most'} {bar:.3g}"
    if most < math.inf:
        asked = f"{bar:.3g} to {most:.3g}"
    met = bar <= score.value <= most if least else score.value <= bar
    return f"{asked}, {'met' if met else 'missed'}" if score.count else asked
