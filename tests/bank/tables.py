"""The bank's page: every score beside its bar for each generator, and the confusion matrix."""

from __future__ import annotations

from collections.abc import Sequence

from tests.bank.score import BARS, Judged, Score, confusion, scores

__all__ = ["page"]

_MOST_COVERED = 0.97


def page(judged: Sequence[Judged], drawn: int, failed: Sequence[str], seed: int) -> str:
    """Return the page in Markdown.

    Args:
        judged: answers beside their labels.
        drawn: how many cases were drawn.
        failed: what became of those without an answer, one line each.
        seed: of the draw.
    """
    parts = [
        "# The bank of hidden-effect cases", "",
        f"Written by `make bank SEED={seed}`: {drawn} cases drawn, {len(judged)} answered. What "
        "a case is and how it is scored: [the bank's own page](../decisions/0010-bank.md). "
        "Intervals are Wilson's at 90 %.", "",
        "| score | twin's cases | bar | independent engine's | bar |", "|---|---|---|---|---|",
    ]  # fmt: skip
    columns = {
        source: scores([one for one in judged if one.label["generator"] == source])
        for source in ("twin", "rod")
    }
    for twin, rod in zip(columns["twin"], columns["rod"], strict=True):
        bar = BARS[twin.name]
        cells = [_cell(twin), _verdict(twin, bar.twin, bar.least), _cell(rod),
                 _verdict(rod, bar.rod, bar.least)]  # fmt: skip
        parts.append(f"| {twin.name} | {' | '.join(cells)} |")
    parts += ["", "## What was said of what", "", "| truth | answers |", "|---|---|"]
    for truth, said in sorted(confusion(judged).items()):
        told = ", ".join(f"{answer} {count}" for answer, count in said.most_common())
        parts.append(f"| {truth} | {told} |")
    if failed:
        parts += ["", "## Cases without an answer", "", *(f"- {line}" for line in failed)]
    return "\n".join(parts) + "\n"


def _cell(score: Score) -> str:
    if score.count == 0:
        return "no case"
    if score.hits is None:
        return f"{score.value:.3g} of {score.count}"
    low, high = score.interval90
    return f"{score.hits} of {score.count}: {score.value:.0%} ({low:.0%} to {high:.0%})"


def _verdict(score: Score, bar: float, least: bool) -> str:
    if score.count == 0:
        return f"{'at least' if least else 'at most'} {bar:.3g}"
    met = score.value >= bar if least else score.value <= bar
    if score.name == "90 % interval coverage":
        met = met and score.value <= _MOST_COVERED
    return f"{'at least' if least else 'at most'} {bar:.3g}, {'met' if met else 'missed'}"
