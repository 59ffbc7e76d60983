"""Several speeds, voltages, pulls or heights: a list, or evenly from one to another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, core_schema

from workbench.schemas.quantity import DIMENSIONS, UnitQuantity, parse_quantity
from workbench.schemas.section import Section
from workbench.schemas.wording import found_in_words

__all__ = ["Even", "Heights", "Pulls", "Speeds", "Voltages", "levels"]

_MOST = 1000
_EXAMPLE = "{from: 16 rad/s, to: 21 rad/s, step: 1 rad/s}"
_KINDS = dict.fromkeys(("from", "to", "step"), "text with a unit") | {"count": "2 to 1000"}
_WHOLE = 1e-6  # how far a range may end beside a whole number of steps


class Even(Section):
    """Evenly spaced values; both ends belong to them."""

    start: Annotated[str, Field(alias="from")]
    """First value with its unit."""
    end: Annotated[str, Field(alias="to")]
    """Last value with its unit; below the first to go down."""
    step: str | None = None
    """Distance of two values with its unit."""
    count: Annotated[int, Field(ge=2, le=_MOST)] | None = None
    """How many values, in place of step."""


def levels(given: object, quantity: UnitQuantity) -> object:
    """Return a range as the texts of its values; a list as it is.

    Raises:
        ValueError: when the steps do not lead from one end to the other.
    """
    if not isinstance(given, dict):
        return given
    even = _even(given)
    start, unit = parse_quantity(even.start, quantity.dimension)
    end, _ = parse_quantity(even.end, quantity.dimension)
    factor = DIMENSIONS[quantity.dimension][unit]
    count = _count(even, end - start, quantity)
    # written in the unit of the first value, so that bounds are given in it
    return [
        f"{float(f'{(start + (end - start) * i / (count - 1)) / factor:.9g}')} {unit}"
        for i in range(count)
    ]


def _count(even: Even, span: float, quantity: UnitQuantity) -> int:
    if (even.step is None) == (even.count is None):
        raise ValueError("a range needs either step or count beside from and to")
    if even.count is not None:
        return even.count
    step = UnitQuantity(quantity.dimension, above=0).read(even.step)
    steps = min(abs(span) / step, 1e9)
    if not 1 <= round(steps) < _MOST or not math.isclose(steps, round(steps), abs_tol=_WHOLE):
        raise ValueError(
            f"steps of {even.step} do not lead from {even.start} to {even.end}: "
            f"that is {steps:g} steps"
        )
    return round(steps) + 1


def _even(given: dict[str, object]) -> Even:
    try:
        return Even.model_validate(given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(step) for step in first["loc"])
        words = {"missing": f"a range needs {key!r}", "extra_forbidden": f"a range has no {key!r}"}
        text = words.get(
            first["type"], f"{key} must be {_KINDS[key]}, found {found_in_words(first['input'])}"
        )
        raise ValueError(f"{text}; write for example {_EXAMPLE}") from None


@dataclass(frozen=True)
class _Several:
    """Annotation of a field that holds several values of a quantity, as a list or a range."""

    quantity: UnitQuantity

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Check each value by itself, so that a fault is reported at its position in the list."""
        item = Annotated[float, self.quantity]
        several = Annotated[tuple[item, ...], Field(min_length=1, max_length=_MOST)]
        return core_schema.no_info_before_validator_function(
            lambda given: levels(given, self.quantity),
            handler.generate_schema(several),
            json_schema_input_schema=handler.generate_schema(list[item] | Even),
        )


Speeds = Annotated[tuple[float, ...], _Several(UnitQuantity("speed", above=0))]
Voltages = Annotated[tuple[float, ...], _Several(UnitQuantity("voltage", above=0))]
Pulls = Annotated[tuple[float, ...], _Several(UnitQuantity("force", above=0))]
Heights = Annotated[tuple[float, ...], _Several(UnitQuantity("length", above=0, high=1))]
