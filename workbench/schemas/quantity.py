"""Quantities as text with a unit, `17 rad/s`, read into SI floats.

A field of a file schema is annotated `Annotated[float, Quantity("speed", low=0)]`; bounds are in SI
and reported in the unit the user wrote.
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
from workbench.schemas.wording import found_in_words

__all__ = ["DIMENSIONS", "UnitQuantity", "parse_quantity"]

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
    "temperature": {"degC": 1.0, "°C": 1.0},
    "stress": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
}
"""Dimension -> unit -> factor to SI; temperatures stay in degrees Celsius."""

_USUAL = {"length": "mm", "stress": "MPa"}
"""Units of the robot's size, for examples, where SI is not."""

_ALSO: dict[str, dict[str, str]] = {
    "time": {
        "s": "s sec secs second seconds sek sekunde sekunden",
        "ms": "msec millisecond milliseconds millisekunde millisekunden",
        "min": "min mins minute minutes minuten",
        "h": "h hr hrs hour hours std stunde stunden",
    },
    "speed": {
        "rpm": "rpm u/min upm 1/min min^-1 min-1 rev/min r/min /min umdrehungen/min",
        "Hz": "1/s s^-1 s-1 u/s rps rev/s r/s hz hertz",
        "rad/s": "rad/sec rads rad/sek",
    },
    "angle": {"deg": "° degree degrees grad", "rad": "radian radians"},
    "voltage": {"V": "v volt volts", "mV": "millivolt millivolts"},
    "current": {"A": "a amp amps ampere amperes", "mA": "milliamp milliamps milliampere"},
    "length": {
        "m": "m meter meters metre metres",
        "cm": "cm centimeter centimeters centimetre centimetres zentimeter",
        "mm": "mm millimeter millimeters millimetre millimetres",
    },
    "force": {"N": "n newton newtons", "mN": "millinewton"},
    "rate": {"Hz": "hz 1/s fps hertz"},
    "mass": {"g": "g gr gram grams gramm", "kg": "kg kilo kilogram kilograms kilogramm"},
    "temperature": {"degC": "c ℃ ºc deg.c grad grad.c gradc celsius degree.c degrees.c"},
}
"""Dimension -> unit -> what people write for it; understood where they type, named in files."""

_GRAVITY = 9.81  # [m/s^2]
_LONGEST = 100  # characters; a number with a unit has ten
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*")
_COMMA = re.compile(r"\s*([+-]?)(\d*),(\d+)\s*((?:[^\d.,\s].*?)?)\s*")
_CLOCK = re.compile(r"\s*(\d+):([0-5]?\d)(?::([0-5]?\d))?\s*[^\d:]*")


def parse_quantity(text: object, dimension: str, typed: bool = False) -> tuple[float, str]:
    """Return the value in SI and the unit of a text such as `17 rad/s`.

    Args:
        text: to be read.
        dimension: key of `DIMENSIONS`.
        typed: whether somebody typed it who waits for the answer: then `21,5 grad C` is understood
            too, where it can mean one thing only. A file is for others as well and has one form.

    Raises:
        ValueError: with the units that the dimension knows.
    """
    units = DIMENSIONS[dimension]
    known, usual = ", ".join(units), _USUAL.get(dimension, next(iter(units)))
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        raise ValueError(f"{text} has no unit; write for example '{text} {usual}'")
    if not isinstance(text, str) or len(text) > _LONGEST:
        raise ValueError(
            f"{found_in_words(text)} is not a number with a unit; known units: {known}"
        )
    text = text.replace("\u2212", "-")  # a minus sign as it is printed
    if (point := _with_point(text, dimension, typed)) is not None:
        return parse_quantity(point, dimension, typed)
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a number with a unit; known units: {known}")
    number, unit = match.groups()
    if not unit:
        raise ValueError(f"{number} has no unit; write for example '{number} {usual}'")
    if typed:
        unit = _meant(unit, dimension) or unit
    if unit not in units:
        raise ValueError(
            f"unknown unit {unit!r} in {text!r}; known units: {known}"
            f"{_hint(number, unit, dimension)}"
        )
    value = float(number) * units[unit]
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is not a finite number")
    return value, unit


def _with_point(text: str, dimension: str, typed: bool) -> str | None:
    """Return a number with a decimal comma, or a time as clocks show it, in the one form.

    None where it is neither.

    Raises:
        ValueError: where it could mean two things, or is in a file; says how to write it.
    """
    if dimension == "time" and (clock := _CLOCK.fullmatch(text)):
        first, second, third = clock.groups()
        count = 60 * int(first) + int(second)
        if third is None:
            raise ValueError(
                f"{text!r} may be hours or minutes; write '{count} min' or '{count} s'"
            )
        point = f"{60 * count + int(third)} s"
        if not typed:
            raise ValueError(f"{text!r} is not a number with a unit; write '{point}'")
        return point
    comma = _COMMA.fullmatch(text)
    if comma is None:
        if re.match(r"\s*[+-]?[\d.]*,\d", text):
            raise ValueError(
                f"{text!r} has a comma among its digits; write a number with a decimal point "
                "alone, such as 1234.5"
            )
        return None
    sign, whole, part, unit = comma.groups()
    unit = _meant(unit, dimension) or unit
    point = f"{sign}{whole or 0}.{part} {unit}".rstrip()
    if len(part) == 3 and 1 <= len(whole) <= 3 and whole.strip("0"):
        other = f"{sign}{whole}{part} {unit}".rstrip()
        raise ValueError(
            f"{text!r} may be {whole}.{part} or {whole}{part}; write '{point}' or '{other}'"
        )
    if not typed:
        usual = _USUAL.get(dimension, next(iter(DIMENSIONS[dimension])))
        shown = point if unit else f"{point} {usual}"
        raise ValueError(f"{text!r} has a decimal comma; write '{shown}'")
    return point


def _meant(unit: str, dimension: str) -> str | None:
    """Return the unit that is meant by what people write for it; None where that is not known."""
    plain = ".".join(unit.casefold().replace("°", "grad.").replace(".", " ").split())
    if unit in DIMENSIONS[dimension]:
        return unit
    for known, others in _ALSO.get(dimension, {}).items():
        if plain in others.split() or unit.casefold() in others.split():
            return known
    return None


def _hint(number: str, unit: str, dimension: str) -> str:
    """Return which unit was perhaps meant, of those that are allowed there and of no others."""
    if dimension == "force" and unit in DIMENSIONS["mass"]:
        weight = float(number) * DIMENSIONS["mass"][unit] * _GRAVITY
        return f"; {number} {unit} weigh {weight:.3g} N"
    others = [name for name, units in DIMENSIONS.items() if unit in units]
    if others:
        return f"; {unit} is a unit of {others[0].replace('_', ' ')}"
    meant = _meant(unit, dimension)
    if meant is not None:
        return f"; did you mean {meant!r}?"
    return did_you_mean(unit, DIMENSIONS[dimension], likeness=0.5)


@dataclass(frozen=True)
class UnitQuantity:
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

    def read(self, text: object, typed: bool = False) -> float:
        """Return the SI value.

        Args:
            text: to be read.
            typed: as in `parse_quantity`.

        Raises:
            ValueError: when the text is no quantity or lies outside the allowed range.
        """
        value, unit = parse_quantity(text, self.dimension, typed)
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
        return core_schema.no_info_plain_validator_function(lambda given: self.read(given))

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
