"""This terminal as an operator's console, for the verbs that carry out experiments."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from workbench.bundle import Bundle
from workbench.cli.console import progress
from workbench.cli.views import draw_views
from workbench.run import (
    Bench,
    ControlServer,
    Course,
    Experiment,
    Operator,
    carry_out_with_control,
    operator_of,
)
from workbench.schemas import BenchFile

__all__ = ["carry_out_at_terminal", "operator_at_terminal", "print_text"]


def carry_out_at_terminal(
    experiment: Experiment,
    bench: Bench,
    runs: Path,
    course: Course | None = None,
    pause: bool = False,
) -> Iterator[tuple[Bundle, list[str]]]:
    """Carry out an experiment with the person at this terminal; see `carry_out_with_control`."""
    return carry_out_with_control(
        experiment, bench, runs, operator_at_terminal, progress, draw_views, course, pause
    )


def operator_at_terminal(bench: BenchFile, server: ControlServer) -> Operator:
    """Return who answers the prompts of a bench, with this terminal."""
    return operator_of(bench, server, print_text, progress)


def print_text(text: str, *, bold: bool = False, end: str = "\n") -> None:
    """Print a text; where an answer is typed on its line, the progress line is off meanwhile."""
    if not end.endswith("\n"):
        progress.pause()
    progress.note(text, "bold" if bold else None, end)
