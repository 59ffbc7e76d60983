"""Put a prompt of the plan to the operator and bring the answer back."""

from __future__ import annotations

from typing import Any, NamedTuple

from workbench.errors import InputError
from workbench.protocol import DIMENSIONS, Answer, PlannedPrompt
from workbench.takes import Operator, Place

__all__ = ["Answered", "ask"]

_TRIES = 5


class Answered(NamedTuple):
    """A prompt and what became of it.

    Args:
        prompt: as planned.
        answer: what was typed, None where it was only confirmed or nobody was there to type.
        place: where.
    """

    prompt: PlannedPrompt
    answer: Answer | None
    place: Place

    def journal(self) -> dict[str, Any]:
        """Return the facts for the journal."""
        question, where = self.prompt.question, {"where": self.place}
        if question is None:
            return {"text": self.prompt.text, "answer": "confirmed"} | where
        return {"text": self.prompt.text, "name": question.name, "answer": self.answer} | where

    def fact(self) -> dict[str, Any]:
        """Return name -> value with its unit, for the manifest; empty where none was asked."""
        question = self.prompt.question
        if question is None:
            return {}
        unit = None if question.quantity is None else next(iter(DIMENSIONS[question.quantity]))
        return {question.name: {"value": self.answer, "unit": unit}}


def ask(operator: Operator, prompt: PlannedPrompt) -> Answered:
    """Show a prompt and wait until it is confirmed, or answered with something that is taken.

    On a bench without an operator nobody types: a value stays open.

    Raises:
        InputError: when several answers in a row are not taken.
    """
    question = prompt.question
    if question is None or not operator.present:
        _show_picture(operator, prompt)
        operator.confirm(prompt.text)
        return Answered(prompt, None, operator.answered_at)
    asked = f"{prompt.text} [{question.name}: {question.hint}]"
    for _ in range(_TRIES):
        _show_picture(operator, prompt)
        try:
            answer = question.read(operator.ask(asked, "", question.one_of or ()))
            return Answered(prompt, answer, operator.answered_at)
        except ValueError as error:
            operator.tell(f"not taken: {error}")
    raise InputError(f"{question.name}: {_TRIES} answers were not taken; {question.hint} is needed")


def _show_picture(operator: Operator, prompt: PlannedPrompt) -> None:
    if prompt.picture is not None:
        operator.show_picture(prompt.picture)
