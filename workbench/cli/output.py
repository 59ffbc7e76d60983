"""What the verbs share: where results go, tables, the operator at the terminal."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from workbench.cli.plain import JsonFlag, RunsFolder, emit
from workbench.errors import InputError
from workbench.quantities import QUANTITIES

__all__ = [
    "ERRORS",
    "JsonFlag",
    "QuietOperator",
    "RunsFolder",
    "TerminalOperator",
    "comparison_table",
    "emit",
    "people",
    "show_table",
    "summary_rows",
    "tell",
]

ERRORS = ("error_mm", "error_foot_mm", "error_top_mm")
NUMBERS = {"real", "twin", "twin - real", "run", "missing", "gaps", "longest gap", "step"}

people = Console(stderr=True, highlight=False, soft_wrap=True)
"""Where text for people goes, so that stdout stays clean for results."""


def tell(text: str) -> None:
    """Tell the phase that begins."""
    people.print(f"  {text}", style="dim", markup=False)


def show_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout; columns whose name ends in a unit hold numbers."""
    table = Table(title=title, title_justify="left", title_style="bold", show_header=any(head))
    for name in head:
        number = name.endswith("]") or name in NUMBERS
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    Console(highlight=False, markup=False).print(table)


def comparison_table(manifest: Mapping[str, Any]) -> None:
    """Print what the robot and its twin did, side by side."""
    real, twin = manifest["real"], manifest["twin"]
    rows = [
        [f"{name.lower()} [{unit}]",
         *(f"{factor * source[key]:.{digits}f}" for source in (real, twin)),
         f"{factor * (twin[key] - real[key]):+.{digits}f}"]
        for key, (name, unit, factor, digits) in QUANTITIES.items()
        if key in real
    ]  # fmt: skip
    show_table(manifest["title"], ["", "real", "twin", "twin - real"], rows)
    Console(highlight=False).print(
        "error of the twin: {:.1f} mm rms (foot {:.1f}, T {:.1f})".format(
            *(manifest[key] for key in ERRORS)
        )
    )


def summary_rows(summary: Mapping[str, float]) -> list[tuple[str, str]]:
    """Return the numbers of a summary as rows of name and value with unit."""
    return [
        (name.lower(), f"{factor * summary[key]:.{digits}f} {unit}")
        for key, (name, unit, factor, digits) in QUANTITIES.items()
        if key in summary
    ]


class TerminalOperator:
    """The person at this terminal."""

    @property
    def present(self) -> bool:
        """Whether this is a terminal."""
        return sys.stdin.isatty()

    def tell(self, text: str) -> None:
        """Show it among the phases, but not to be overlooked."""
        people.print(text, style="bold", markup=False)

    def confirm(self, text: str) -> None:
        """Wait for Enter."""
        self._require_terminal(text)
        people.print(text, style="bold", markup=False, end="  (Enter) ")
        _line(text)

    def ask(self, text: str, default: str) -> str:
        """Read a line; empty takes the default."""
        self._require_terminal(text)
        offered = f" [{default}]" if default else ""
        people.print(text, style="bold", markup=False, end=f"{offered}: ")
        return _line(text).strip() or default

    def _require_terminal(self, text: str) -> None:
        if not self.present:
            raise _nobody(text)


def _line(text: str) -> str:
    try:
        return input()
    except EOFError:
        raise _nobody(text) from None


def _nobody(text: str) -> InputError:
    return InputError(f"nobody to ask at this terminal: {text!r}")


class QuietOperator:
    """Answers every prompt itself: on the virtual bench there is nobody to ask."""

    present = False

    def tell(self, text: str) -> None:
        """Show the text."""
        tell(text)

    def confirm(self, text: str) -> None:
        """Show the text and go on."""
        tell(f"prompt: {text}")

    def ask(self, text: str, default: str) -> str:
        """Take the default."""
        tell(f"prompt: {text} [{default}]")
        return default
