"""Tables, progress and text on stderr with rich, for the verbs that can wait for its import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from textwrap import fill
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from workbench.cli.progress import ProgressLine
from workbench.quantities import QUANTITIES, unit_of

if TYPE_CHECKING:
    from workbench.bundle import Compared, Judgement

__all__ = [
    "comparison_table",
    "fact_rows",
    "print_judgements",
    "print_notes",
    "progress",
    "show_table",
    "stderr",
    "summary_rows",
]

_MOST_NOTES = 12
_ON = {True: "on", False: "off"}
NUMBERS = {"real", "twin", "twin - real", "run", "missing", "gaps", "longest gap", "step"}

progress = ProgressLine(Console(stderr=True, highlight=False, soft_wrap=True))
"""Called with each stage as it begins; the one way in which the verbs show progress."""


class _Stderr(Console):
    """Ends the line of progress before it prints."""

    def print(self, *objects: Any, **how: Any) -> None:
        progress.pause()
        super().print(*objects, **how)

    def sentence(self, text: str, indent: str = "  ") -> None:
        """Print a sentence, broken between words on a terminal and on one line elsewhere."""
        if self.is_terminal:
            text = fill(
                text, self.width, subsequent_indent=indent, break_long_words=False,
                break_on_hyphens=False,
            )  # fmt: skip
        self.print(text, markup=False)


stderr = _Stderr(stderr=True, highlight=False, soft_wrap=True)
"""Prints text for people, so that stdout stays clean for results."""


def show_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout; columns whose name ends in a unit hold numbers."""
    table = Table(title=title, title_justify="left", title_style="bold", show_header=any(head))
    for name in head:
        number = name.endswith("]") or name in NUMBERS
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    Console(highlight=False, markup=False).print(table)


def comparison_table(title: str, compared: Compared) -> None:
    """Print what the robot and its twin did, side by side."""
    real, twin = compared.real.model_dump(), compared.twin.model_dump()
    rows = [
        [
            f"{one.spoken} [{one.unit}]",
            *(one.number(source[key]) for source in (real, twin)),
            f"{one.apart(real[key], twin[key]):+.{one.digits}f}",
        ]
        for key, one in QUANTITIES.items()
        if key in real
    ]
    show_table(title, ["", "real", "twin", "twin - real"], rows)
    Console(highlight=False).print(
        f"error of the twin: {compared.error_mm:.1f} mm rms (foot {compared.error_foot_mm:.1f}, "
        f"T {compared.error_top_mm:.1f})"
    )
    print_notes(compared.warnings)


def print_judgements(judged: Sequence[Judgement]) -> None:
    """Print whether results lie where the protocol expects them."""
    for one in judged:
        _, result, expected = one.words
        style = "bold green" if one.passed else "bold red"
        line = Text.assemble(
            (one.mark, style), f"  {one.quantity.spoken} {result}, expected {expected}"
        )
        Console(highlight=False).print(line)


def print_notes(warnings: Sequence[str]) -> None:
    """Print what a user should know before trusting the numbers; of many the first ones."""
    for warning in warnings[:_MOST_NOTES]:
        print(f"note: {warning}")
    if len(warnings) > _MOST_NOTES:
        print(f"and {len(warnings) - _MOST_NOTES} more notes; --json has all of them")


def fact_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return facts by name and value, in words, units and sensible digits; without what is None."""
    rows = []
    for key, value in facts.items():
        end, unit = unit_of(key)
        text = _ON[value] if isinstance(value, bool) else _rounded(value)
        if value is not None:
            rows.append((key.removesuffix(end).replace("_", " "), f"{text} {unit}".rstrip()))
    return rows


def _rounded(value: object) -> str:
    return f"{float(value):.4g}" if isinstance(value, float | Decimal) else str(value)


def summary_rows(summary: Mapping[str, float]) -> list[tuple[str, str]]:
    """Return the numbers of a summary as rows of name and value with unit."""
    return [
        (one.spoken, one.text(summary[key])) for key, one in QUANTITIES.items() if key in summary
    ]
