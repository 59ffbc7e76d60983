"""What the verbs share: where results go, tables, the operator at the terminal."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from workbench.cli.keyboard import Keyboard
from workbench.cli.plain import JsonFlag, RunsFolder, emit
from workbench.cli.progress import ProgressLine
from workbench.desk import Desk, Question, Reply
from workbench.errors import InputError
from workbench.quantities import QUANTITIES

if TYPE_CHECKING:
    from workbench.bundle import Compared
    from workbench.takes import Place  # which loads far more than a table needs

__all__ = [
    "JsonFlag",
    "QuietOperator",
    "RunsFolder",
    "TerminalOperator",
    "comparison_table",
    "emit",
    "people",
    "print_notes",
    "show_table",
    "summary_rows",
    "tell",
]

_WAIT_S = 0.1  # Windows hears Ctrl-C between waits only
_RELOAD_S = 5.0
_MOST_NOTES = 12
NUMBERS = {"real", "twin", "twin - real", "run", "missing", "gaps", "longest gap", "step"}

people = Console(stderr=True, highlight=False, soft_wrap=True)
"""Where text for people goes, so that stdout stays clean for results."""

tell = ProgressLine(people)
"""Is told each stage as it begins; the one way in which the verbs show progress."""


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
        [f"{name.lower()} [{unit}]",
         *(f"{factor * source[key]:.{digits}f}" for source in (real, twin)),
         f"{factor * (twin[key] - real[key]):+.{digits}f}"]
        for key, (name, unit, factor, digits) in QUANTITIES.items()
        if key in real
    ]  # fmt: skip
    show_table(title, ["", "real", "twin", "twin - real"], rows)
    Console(highlight=False).print(
        f"error of the twin: {compared.error_mm:.1f} mm rms (foot {compared.error_foot_mm:.1f}, "
        f"T {compared.error_top_mm:.1f})"
    )
    print_notes(compared.warnings)


def print_notes(warnings: Sequence[str]) -> None:
    """Print what a user should know before trusting the numbers; of many the first ones."""
    for warning in warnings[:_MOST_NOTES]:
        print(f"note: {warning}")
    if len(warnings) > _MOST_NOTES:
        print(f"and {len(warnings) - _MOST_NOTES} more notes; --json has all of them")


def summary_rows(summary: Mapping[str, float]) -> list[tuple[str, str]]:
    """Return the numbers of a summary as rows of name and value with unit."""
    return [
        (name.lower(), f"{factor * summary[key]:.{digits}f} {unit}")
        for key, (name, unit, factor, digits) in QUANTITIES.items()
        if key in summary
    ]


class TerminalOperator:
    """The person at this terminal, or at a page that shows this run; whoever answers first.

    Args:
        desk: shows the prompts elsewhere.
        keyboard: of this terminal.
        needed: whether somebody has to answer; otherwise a prompt that nobody sees is passed.
    """

    answered_at: Place = "nobody"

    def __init__(self, desk: Desk, keyboard: Keyboard, needed: bool = True) -> None:
        self._desk, self._keyboard, self._needed = desk, keyboard, needed
        self._picture: Path | None = None

    @property
    def present(self) -> bool:
        """Whether this is a terminal, or a page is open."""
        return self._keyboard.present or self._desk.attended

    def tell(self, text: str) -> None:
        """Show it among the stages, but not to be overlooked."""
        self._desk.show_notice(text)
        people.print(text, style="bold", markup=False)

    def show_picture(self, picture: Path) -> None:
        """Tell where it lies, and show it where the next prompt is shown elsewhere."""
        self._picture = picture
        people.print(f"see {picture}", markup=False)

    def confirm(self, text: str) -> None:
        """Wait for Enter."""
        picture, self._picture = self._picture, None
        with self._desk.ask(text, typed=False, picture=picture) as question:
            self._answer(question, "  (Enter) ")

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        """Read a line; empty takes the default."""
        offered = f" [{default}]" if default else ""
        picture, self._picture = self._picture, None
        asked = self._desk.ask(
            text, typed=True, default=default, picture=picture, choices=tuple(choices)
        )
        with asked as question:
            return self._answer(question, f"{offered}: ") or default

    def _answer(self, question: Question, end: str) -> str:
        """Wait for the first answer, and note where it came from."""
        tell.pause()
        people.print(question.text, style="bold", markup=False, end=end)
        with self._keyboard.lines_to(lambda line: question.offer(Reply(line, "terminal"))):
            reply = self._first(question)
        if reply.place != "terminal":
            people.print(f"{reply.text or 'confirmed'} ({reply.place})", markup=False)
        self.answered_at = reply.place
        return reply.text

    def _first(self, question: Question) -> Reply:
        """Wait as long as somebody could answer; a page that is loaded anew is back at once."""
        seen = time.monotonic() - (0.0 if self.present else _RELOAD_S)
        while (reply := question.wait(_WAIT_S)) is None:
            if self.present:
                seen = time.monotonic()
            elif time.monotonic() - seen > _RELOAD_S:
                if self._needed:
                    raise InputError(f"nobody to ask at this terminal: {question.text!r}")
                return Reply(question.default, "nobody")
        return reply


class QuietOperator:
    """Answers every prompt itself: on the virtual bench there is nobody to ask."""

    present = False
    answered_at: Place = "nobody"

    def tell(self, text: str) -> None:
        """Show the text."""
        tell(text)

    def show_picture(self, picture: Path) -> None:
        """Tell where it lies."""
        tell(f"see {picture}")

    def confirm(self, text: str) -> None:
        """Show the text and go on."""
        tell(f"prompt: {text}")

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        """Take the default."""
        tell(f"prompt: {text} [{default}]")
        return default
