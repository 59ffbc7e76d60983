"""Put a prompt of the plan to the operator and bring the answer back."""

from __future__ import annotations

from typing import NamedTuple

from workbench.bundle import AnswerFact, events
from workbench.errors import InputError
from workbench.run.takes import AnsweredAt, Operator
from workbench.schemas import DIMENSIONS, Answer, PlannedPrompt

__all__ = ["PromptAnswer", "ask"]

_TRIES = 5


class PromptAnswer(NamedTuple):
    """A prompt and what became of it.

    Args:
        prompt: as planned.
        answer: what was typed, None where it was only confirmed or nobody was there to type.
        answered_at: where.
    """

    prompt: PlannedPrompt
    answer: Answer | None
    answered_at: AnsweredAt

    def event(self, asked_s: float | None) -> events.PromptAnswered:
        """Return the event for the journal.

        Args:
            asked_s: when it was shown, on the clock of the run [s]; None before that runs.
        """
        question, text = self.prompt.question, self.prompt.text
        seen = self.answered_at != "nobody"
        answer = ("confirmed" if seen else None) if question is None else self.answer
        facts = events.PromptAnswered(text=text, answer=answer, where=self.answered_at)
        named = {} if question is None else {"name": question.name}
        waited = {} if asked_s is None else {"asked_s": asked_s}
        return facts.model_copy(update=named | waited)

    def fact(self) -> dict[str, AnswerFact]:
        """Return name -> value with its unit, for the manifest; empty where none was asked."""
        question = self.prompt.question
        if question is None:
            return {}
        unit = None if question.quantity is None else next(iter(DIMENSIONS[question.quantity]))
        return {question.name: AnswerFact(value=self.answer, unit=unit)}


def ask(operator: Operator, prompt: PlannedPrompt) -> PromptAnswer:
    """Show a prompt and wait until it is confirmed, or answered with something that is taken.

    On a bench without an operator nobody types: a value stays open.

    Raises:
        InputError: when several answers in a row are not taken.
    """
    question = prompt.question
    if question is None or not operator.present:
        _show_picture(operator, prompt)
        operator.confirm(prompt.text)
        return PromptAnswer(prompt, None, operator.answered_at)
    asked = f"{prompt.text} [{question.name}: {question.hint}]"
    for _ in range(_TRIES):
        _show_picture(operator, prompt)
        try:
            answer = question.read(operator.ask(asked, "", question.one_of or ()))
            return PromptAnswer(prompt, answer, operator.answered_at)
        except ValueError as error:
            operator.show_text(f"not taken: {error}")
    raise InputError(f"{question.name}: {_TRIES} answers were not taken; {question.hint} is needed")


def _show_picture(operator: Operator, prompt: PlannedPrompt) -> None:
    if prompt.picture is not None:
        operator.show_picture(prompt.picture)
