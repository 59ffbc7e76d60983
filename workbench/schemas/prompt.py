"""What the operator is shown and asked between and around the runs."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from workbench.errors import did_you_mean
from workbench.schemas.quantity import DIMENSIONS, UnitQuantity
from workbench.schemas.section import Section
from workbench.schemas.wording import found_in_words

__all__ = ["Answer", "OperatorPrompt", "PromptOrText", "PromptQuestion"]

Answer = float | str
"""What was typed: a number in SI, or text."""

Dimension = Literal[
    "time", "speed", "angle", "voltage", "current", "length", "force", "mass", "temperature"
]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]


def _bound(given: object) -> object:
    if isinstance(given, (int, float)) and not isinstance(given, bool):
        raise ValueError(f"{given} has no unit; write it with its unit")
    return given


Bound = Annotated[str, BeforeValidator(_bound, json_schema_input_type=str)]


class PromptQuestion(Section):
    """A value that the operator types in; it is kept with the run."""

    name: Name
    """Under which the value is kept, such as battery_voltage."""
    quantity: Dimension | None = None
    """The value is a number with a unit of this kind; otherwise it is text."""
    low: Bound | None = None
    """Least value that is taken, with its unit."""
    high: Bound | None = None
    """Greatest value that is taken, with its unit."""
    one_of: Annotated[tuple[str, ...], Field(min_length=2)] | None = None
    """The only answers that are taken."""

    @model_validator(mode="after")
    def _consistent(self) -> PromptQuestion:
        if self.quantity is not None and self.one_of is not None:
            raise ValueError("a value is either a quantity or one_of some words, not both")
        if self.quantity is None and (self.low is not None or self.high is not None):
            raise ValueError("low and high belong to a quantity; add for example quantity: length")
        if self.quantity is not None:
            low, high = self._checked("low", self.low), self._checked("high", self.high)
            if low is not None and high is not None and low >= high:
                raise ValueError(f"low {self.low} is not below high {self.high}")
        return self

    def read(self, typed: str) -> Answer:
        """Return what was typed as a number in SI, or as text.

        Raises:
            ValueError: when it is not what is asked for; says what would be.
        """
        if self.quantity is not None:
            bounds = [self._bound(end) for end in (self.low, self.high)]
            return UnitQuantity(self.quantity, low=bounds[0], high=bounds[1]).read(
                typed, typed=True
            )
        if not typed:
            raise ValueError("nothing was typed")
        if self.one_of is not None and typed not in self.one_of:
            hint = did_you_mean(typed, self.one_of)
            raise ValueError(f"{typed!r} is not one of {', '.join(self.one_of)}{hint}")
        return typed

    @property
    def hint(self) -> str:
        """Return what may be typed, in words."""
        if self.one_of is not None:
            return ", ".join(self.one_of)
        if self.quantity is None:
            return "text"
        ends = [f"{word} {end}" for word, end in (("from", self.low), ("to", self.high)) if end]
        return " ".join([f"{self.quantity} in {' or '.join(DIMENSIONS[self.quantity])}", *ends])

    def _bound(self, end: str | None) -> float | None:
        return None if end is None else UnitQuantity(self.quantity or "").read(end)

    def _checked(self, name: str, end: str | None) -> float | None:
        try:
            return self._bound(end)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None


class OperatorPrompt(Section):
    """A text for the operator, who confirms it or types a value in."""

    text: Annotated[str, Field(min_length=1)]
    picture: str | None = None
    """Path of a picture from this file's folder; its path is shown, the panel shows it itself."""
    value: PromptQuestion | None = None
    """Value to type in; without it the operator only confirms."""


def _prompt(given: object) -> object:
    if isinstance(given, (int, float, bool)):
        raise ValueError(
            f"must be a text or a mapping, found {found_in_words(given)}; put it in quotes, "
            f"'{found_in_words(given)}'"
        )
    return {"text": given} if isinstance(given, str) else given


PromptOrText = Annotated[
    OperatorPrompt, BeforeValidator(_prompt, json_schema_input_type=str | OperatorPrompt)
]
"""A prompt, or its text alone."""
