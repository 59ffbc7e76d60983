"""What the verbs share: where results go, tables, the operator at the terminal."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from workbench.cli.progress import ProgressLine
from workbench.errors import InputError
from workbench.review import QUANTITIES

__all__ = [
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

JsonFlag = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
RunsFolder = Annotated[
    Path, typer.Option("--runs", help="Folder of all bundles.", envvar="WORKBENCH_RUNS")
]

NUMBERS = {"real", "twin", "twin - real", "run", "missing", "gaps", "longest gap", "step"}

people = Console(stderr=True, highlight=False, soft_wrap=True)
"""Where text for people goes, so that stdout stays clean for results."""

tell = ProgressLine(people)
"""Is told each stage as it begins; the one way in which the verbs show progress."""


def emit(result: Mapping[str, Any]) -> None:
    """Print the one JSON object; what is no number becomes null."""
    print(json.dumps(_finite(result), indent=2, ensure_ascii=False, default=str))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not (abs(value) < float("inf")):
        return None
    return value


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
        f"error of the twin: {manifest['error_mm']:.1f} mm rms "
        f"(foot {manifest['error_foot_mm']:.1f}, T {manifest['error_top_mm']:.1f})"
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
        """Show it among the stages, but not to be overlooked."""
        people.print(text, style="bold", markup=False)

    def confirm(self, text: str) -> None:
        """Wait for Enter."""
        self._require_terminal(text)
        tell.pause()
        people.print(text, style="bold", markup=False, end="  (Enter) ")
        _line(text)

    def ask(self, text: str, default: str) -> str:
        """Read a line; empty takes the default."""
        self._require_terminal(text)
        tell.pause()
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
