"""On what a run stops by itself, besides the limits of its supply."""

from __future__ import annotations

import re
from typing import Annotated, Any, NamedTuple

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from workbench.schemas.quantity import parse_quantity
from workbench.schemas.wording import found_in_words

__all__ = ["StopLimit", "StopWhen"]

_EXAMPLE = "prediction error above 5 mm for 0.2 s"
_FORM = re.compile(r"prediction error above (.+?) for (.+)")
_MOST_M, _MOST_S = 1.0, 10.0


class StopWhen(NamedTuple):
    """A prediction error that ends a run.

    Args:
        above_m: limit [m].
        for_s: how long it has to be above [s].
    """

    above_m: float
    for_s: float

    @property
    def words(self) -> str:
        """Return it as a protocol has it."""
        return f"prediction error above {1e3 * self.above_m:g} mm for {self.for_s:g} s"


class _Read:
    """Reads `prediction error above 5 mm for 0.2 s`."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(cls.read)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"type": "string", "examples": [_EXAMPLE]}

    @staticmethod
    def read(text: object) -> StopWhen:
        """Return the limit.

        Raises:
            ValueError: with the form that it has.
        """
        if isinstance(text, StopWhen):
            return text
        match = _FORM.fullmatch(" ".join(text.split())) if isinstance(text, str) else None
        if match is None:
            found = repr(text) if isinstance(text, str) else found_in_words(text)
            raise ValueError(f"{found} is nothing to stop on; write '{_EXAMPLE}'")
        above, seconds = parse_quantity(match[1], "length")[0], parse_quantity(match[2], "time")[0]
        if not 0 < above <= _MOST_M:
            raise ValueError(
                f"a prediction error above {match[1]} is no limit; give one above 0 mm and up to "
                f"{_MOST_M:g} m"
            )
        if not 0 <= seconds <= _MOST_S:
            raise ValueError(f"for {match[2]} is outside of 0 s to {_MOST_S:g} s")
        return StopWhen(above, seconds)


StopLimit = Annotated[StopWhen, _Read]
"""As text in a file."""
