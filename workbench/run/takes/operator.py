"""What a bench asks of its operator; `workbench.run.operators` are those that there are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, Protocol

__all__ = ["AnsweredAt", "Operator"]

AnsweredAt = Literal["terminal", "panel", "nobody"]
"""Where a prompt was answered; on a bench without an operator it answers itself."""


class Operator(Protocol):
    """The person at the bench."""

    @property
    def present(self) -> bool:
        """Whether somebody can answer."""
        ...

    @property
    def answered_at(self) -> AnsweredAt:
        """Where the last prompt was answered."""
        ...

    def show_text(self, text: str) -> None:
        """Show a text and go on."""
        ...

    def show_picture(self, picture: Path) -> None:
        """Show a picture with the next prompt, or where it lies."""
        ...

    def confirm(self, text: str) -> None:
        """Show a text and return when it is confirmed."""
        ...

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        """Show a question and return the answer; choices are the only ones that will be taken."""
        ...
