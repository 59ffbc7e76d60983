"""This terminal as a bench's operator sees it, for the verbs that carry out experiments."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from workbench.attended import carry_out_with_control
from workbench.bench import Bench, Operator
from workbench.bundle import Bundle
from workbench.cli.output import tell
from workbench.cli.views import draw_views
from workbench.control import ControlServer
from workbench.experiment import Experiment
from workbench.operators import operator_of
from workbench.protocol import BenchFile
from workbench.resume import Course

__all__ = ["carry_out_here", "operator_here", "show"]


def carry_out_here(
    experiment: Experiment,
    bench: Bench,
    runs: Path,
    course: Course | None = None,
    pause: bool = False,
) -> Iterator[tuple[Bundle, list[str]]]:
    """Carry out an experiment with the person at this terminal; see `carry_out_with_control`."""
    return carry_out_with_control(
        experiment, bench, runs, operator_here, tell, draw_views, course, pause
    )


def operator_here(bench: BenchFile, desk: ControlServer) -> Operator:
    """Return who answers the prompts of a bench, where this is the terminal."""
    return operator_of(bench, desk, show, tell)


def show(text: str, *, bold: bool = False, end: str = "\n") -> None:
    """Print a text for people; where an answer follows on its line, nothing is drawn meanwhile."""
    if not end.endswith("\n"):
        tell.pause()
    tell.note(text, "bold" if bold else None, end)
