"""The person at a terminal, or at a page that shows the run."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from workbench.errors import InputError
from workbench.run.control import ControlServer, PendingPrompt, Reply
from workbench.run.operators.keyboard import Keyboard

if TYPE_CHECKING:
    from workbench.run.takes import AnsweredAt  # which loads all of tracking

__all__ = ["Show", "TerminalOperator"]

_WAIT_S = 0.1  # Windows notices Ctrl-C between waits only
_RELOAD_S = 5.0


class Show(Protocol):
    """Puts a text before the person at the terminal."""

    def __call__(self, text: str, *, bold: bool = False, end: str = "\n") -> None:
        """Show it.

        Args:
            text: what is shown.
            bold: whether it must not be overlooked.
            end: what follows it; without a line's end the answer is typed behind it.
        """
        ...


class TerminalOperator:
    """The person at this terminal, or at a page that shows this run; whoever answers first.

    Args:
        server: shows the prompts elsewhere.
        keyboard: of this terminal.
        show: puts a text before the person at the terminal.
        needed: whether somebody has to answer; otherwise a prompt that nobody sees is passed.
    """

    answered_at: AnsweredAt = "nobody"

    def __init__(
        self, server: ControlServer, keyboard: Keyboard, show: Show, needed: bool = True
    ) -> None:
        self._server, self._keyboard, self._show, self._needed = server, keyboard, show, needed
        self._picture: Path | None = None

    @property
    def present(self) -> bool:
        """Whether this is a terminal, or a page is open."""
        return self._keyboard.present or self._server.attended

    def show_text(self, text: str) -> None:
        """Show it among the stages, but not to be overlooked."""
        self._server.show_notice(text)
        self._show(text, bold=True)

    def show_picture(self, picture: Path) -> None:
        """Show where it is, and show it where the next prompt is shown elsewhere."""
        self._picture = picture
        self._show(f"see {picture}")

    def confirm(self, text: str) -> None:
        """Wait for Enter."""
        picture, self._picture = self._picture, None
        with self._server.ask(text, typed=False, picture=picture) as question:
            self._answer(question, "  (Enter) ")

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        """Read a line; empty takes the default."""
        offered = f" [{default}]" if default else ""
        picture, self._picture = self._picture, None
        asked = self._server.ask(
            text, typed=True, default=default, picture=picture, choices=tuple(choices)
        )
        with asked as question:
            return self._answer(question, f"{offered}: ") or default

    def _answer(self, question: PendingPrompt, end: str) -> str:
        """Wait for the first answer, and note where it came from."""
        self._show(question.text, bold=True, end=end)
        with self._keyboard.lines_to(lambda line: question.offer(Reply(line, "terminal"))):
            reply = self._first(question)
        if reply.answered_at != "terminal":
            self._show(f"{reply.text or 'confirmed'} ({reply.answered_at})")
        self.answered_at = reply.answered_at
        return reply.text

    def _first(self, question: PendingPrompt) -> Reply:
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
