"""The notes beside the curves, as markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from workbench.review.comparison import Comparison
from workbench.review.headline import HEADINGS, headline, misfit_rows

__all__ = ["notes"]

_UNSEEN = (
    "The thin orange line from the foot to T stands for the real beam; "
    "the beam between them was not measured."
)


def notes(comparison: Comparison) -> str:
    """Return the headline table with the errors, warnings, facts and what was not measured."""
    parts = [
        f"**{comparison.title}**",
        _numbers(comparison, HEADINGS),
        _extended(comparison),
        "\n".join(f"- **Warning:** {warning}" for warning in comparison.warnings),
        _UNSEEN,
        _table(("Fact", ""), comparison.facts.items()),
    ]
    return "\n\n".join(part for part in parts if part)


def _numbers(comparison: Comparison, heads: Sequence[str]) -> str:
    errors = [(f"Error, {name}", "", "", rms) for name, rms in misfit_rows(comparison.misfit)]
    return _table(heads, [*headline(comparison), *errors])


def _extended(comparison: Comparison) -> str:
    """Return the same table of the extended twin in the twin's place."""
    extended = comparison.extended
    if extended is None:
        return ""
    there = replace(comparison, twin_summary=extended.summary, misfit=extended.misfit)
    heads = [f"Extended twin, {extended.model}" if h == "Twin" else h for h in HEADINGS]
    return _numbers(there, heads)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(map(_cell, line)) + " |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())
