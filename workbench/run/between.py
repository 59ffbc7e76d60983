"""Between two runs of a plan: the next one, the one after it, the same again, or nothing more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from workbench.bundle import Bundle
from workbench.schemas import PlannedPause, PlannedPrompt, PlannedRun

__all__ = ["Between", "Choice", "Part", "go_on", "what_follows"]

Choice = Literal["go on", "skip", "repeat", "end"]
"""What is done after a run."""
Between = Callable[[Bundle, PlannedRun, PlannedRun | None], Choice]
"""Is asked after each run: its bundle, the run, and the one that follows, None after the last.
It is asked again after `skip`, with the run that then follows."""
Part = tuple[Sequence[PlannedPrompt | PlannedPause], PlannedRun]
"""A run with the prompts and pauses before it."""


def go_on(bundle: Bundle, run: PlannedRun, following: PlannedRun | None) -> Choice:
    """Go on as it is planned."""
    return "go on"


def what_follows(parts: Sequence[Part], bundle: Bundle, between: Between) -> Sequence[Part]:
    """Return what is left to be made after a run.

    Args:
        parts: what was left before it, itself first.
        bundle: of the run.
        between: is asked.
    """
    (_, run), following = parts[0], parts[1:]
    while (choice := between(bundle, run, following[0][1] if following else None)) == "skip":
        following = following[1:]
    return {"go on": following, "repeat": (parts[0], *following), "end": ()}[choice]
