"""Nobody: prompts answer themselves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.progress import Progress

if TYPE_CHECKING:
    from workbench.takes import Place  # which loads all of tracking

__all__ = ["QuietOperator"]


class QuietOperator:
    """Answers every prompt itself: on the virtual bench there is nobody to ask.

    Args:
        tell: is told what would have been shown; left out, nobody is.
    """

    present = False
    answered_at: Place = "nobody"

    def __init__(self, tell: Progress = lambda text: None) -> None:
        self._tell = tell

    def tell(self, text: str) -> None:
        """Show the text."""
        self._tell(text)

    def show_picture(self, picture: Path) -> None:
        """Tell where it lies."""
        self._tell(f"see {picture}")

    def confirm(self, text: str) -> None:
        """Show the text and go on."""
        self._tell(f"prompt: {text}")

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        """Take the default."""
        self._tell(f"prompt: {text} [{default}]")
        return default
