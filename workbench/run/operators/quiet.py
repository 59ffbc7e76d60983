"""Nobody: prompts answer themselves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.progress import Progress

if TYPE_CHECKING:
    from workbench.run.takes import AnsweredAt  # which loads all of tracking

__all__ = ["QuietOperator"]


class QuietOperator:
    """Answers every prompt itself: on the virtual bench there is nobody to ask.

    Args:
        show_text: receives what would have been shown; may be left out.
    """

    present = False
    answered_at: AnsweredAt = "nobody"

    def __init__(self, progress: Progress = lambda text: None) -> None:
        self._progress = progress

    def show_text(self, text: str) -> None:
        """Show the text."""
        self._progress(text)

    def show_picture(self, picture: Path) -> None:
        """Show where it is."""
        self._progress(f"see {picture}")

    def confirm(self, text: str) -> None:
        """Show the text and go on."""
        self._progress(f"prompt: {text}")

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        """Take the default."""
        self._progress(f"prompt: {text} [{default}]")
        return default
