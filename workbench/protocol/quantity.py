"""Quantities as text with a unit, `17 rad/s`, read into SI floats.

A field of a file schema is annotated `Annotated[float, Quantity("speed", low=0)]`; bounds are in SI
and told in the unit the user wrote.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from workbench.errors import did_you_mean

__all__ = ["DIMENSIONS", "Quantity", "parse_quantity"]

DIMENSIONS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "speed": {"rad/s": 1.0, "rpm": 2 * math.pi / 60, "Hz": 2 * math.pi},
    "angle": {"rad": 1.0, "deg": math.pi / 180},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "voltage_rate": {"V/s": 1.0},
    "speed_per_voltage": {"rad/s/V": 1.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "force": {"N": 1.0, "mN": 1e-3},
    "rate": {"Hz": 1.0},
    "mass": {"kg": 1.0, "g": 1e-3},
    "temperature": {"degC": 1.0},
    "stress": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
}
"""Dimension -> unit -> factor to SI; temperatures stay in degrees Celsius."""

_USUAL = {"length": "mm", "stress": "MPa"}
"""Units of the robot's size, for examples, where SI is not."""

_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def parse_quantity(text: object, dimension: str) -> tuple[float, str]:
    """Return the value in SI and the unit of a text such as `17 rad/s`.

    Raises:
        ValueError: with the units that the dimension knows.
    """
    units = DIMENSIONS[dimension]
    known, usual = ", ".join(units), _USUAL.get(dimension, next(iter(units)))
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        raise ValueError(f"{text} has no unit; write for example '{text} {usual}'")
    match = _TEXT.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise ValueError(f"{text!r} is not a number with a unit; known units: {known}")
    number, unit = match.groups()
    if not unit:
        raise ValueError(f"{number} has no unit; write for example '{number} {usual}'")
    if unit not in units:
        raise ValueError(f"unknown unit {unit!r} in {text!r}; known units: {known}{_hint(unit)}")
    value = float(number) * units[unit]
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is not a finite number")
    return value, unit


def _hint(unit: str) -> str:
    every = sorted({u for units in DIMENSIONS.values() for u in units})
    return "" if unit in every else did_you_mean(unit, every, likeness=0.5)


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float field that is written with a unit.

    Args:
        dimension: key of `DIMENSIONS`.
        low: least value allowed, SI.
        high: greatest value allowed, SI.
        above: value that must be exceeded, SI.
    """

    dimension: str
    low: float | None = None
    high: float | None = None
    above: float | None = None

    def read(self, text: object) -> float:
        """Return the SI value.

        Raises:
            ValueError: when the text is no quantity or lies outside the allowed range.
        """
        value, unit = parse_quantity(text, self.dimension)
        too_low = self.low is not None and value < self.low
        too_high = self.high is not None and value > self.high
        at_floor = self.above is not None and value <= self.above
        if too_low or too_high or at_floor:
            raise ValueError(f"{text} is not allowed; it must be {self._range(unit)}")
        return value

    def _range(self, unit: str) -> str:
        factor = DIMENSIONS[self.dimension][unit]
        bounds = (("above", self.above), ("at least", self.low), ("at most", self.high))
        return ", ".join(
            f"{word} {end / factor:g} {unit}" for word, end in bounds if end is not None
        )

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Read text with `read`; a dumped file carries SI floats, not text."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Offer editors the pattern and an example."""
        units = list(DIMENSIONS[self.dimension])
        either = "|".join(re.escape(u) for u in units)
        return {
            "type": "string",
            "pattern": rf"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*({either})\s*$",
            "description": f"{self.dimension.replace('_', ' ')} with a unit: {', '.join(units)}",
        }
