"""What a run is expected to come to: ranges of its results, by which it passes or fails."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from workbench.modes import Mode
from workbench.schemas.quantity import parse_quantity
from workbench.schemas.section import Section
from workbench.schemas.wording import found_in_words

__all__ = ["EXPECTED", "Expectation", "Range"]


class Range(NamedTuple):
    """A range of values, SI; None where it is open."""

    low: float | None
    high: float | None


@dataclass(frozen=True)
class _RangeOf:
    """Reads a range such as `0.10 m +- 10 %`, `below 3 mm` or `80 mm to 120 mm`."""

    dimension: str
    example: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"type": "string", "examples": [self.example]}

    def read(self, text: object) -> Range:
        """Return the range.

        Raises:
            ValueError: with the forms that a range may have.
        """
        if isinstance(text, Range):
            return text
        if not isinstance(text, str):
            raise ValueError(f"{found_in_words(text)} is no range; write {self._forms()}")
        words = text.strip()
        if match := re.fullmatch(r"(below|above)\s+(.*)", words):
            value = self._value(match[2])
            return Range(None, value) if match[1] == "below" else Range(value, None)
        if match := re.fullmatch(r"(.*?)\s+to\s+(.*)", words):
            low, high = self._value(match[1]), self._value(match[2])
            if not low < high:
                raise ValueError(f"{words!r} goes from the greater to the smaller value")
            return Range(low, high)
        if match := re.fullmatch(r"(.*?)\s*(?:\+-|\+/-|±)\s*(.*)", words):
            middle = self._value(match[1])
            if share := re.fullmatch(r"(\d+\.?\d*)\s*%", match[2]):
                half = abs(middle) * float(share[1]) / 100
            else:
                half = self._value(match[2])
            if not half > 0:
                raise ValueError(f"{words!r} is a single value; write a range above 0 after +-")
            return Range(middle - half, middle + half)
        raise ValueError(f"{words!r} is no range; write {self._forms()}")

    def _value(self, text: str) -> float:
        if self.dimension == "ratio":
            match = re.fullmatch(r"(\d+\.?\d*)\s*%", text.strip())
            if match is None:
                raise ValueError(f"{text!r} is no share; write for example '0.5 %'")
            return float(match[1]) / 100
        return parse_quantity(text, self.dimension)[0]

    def _forms(self) -> str:
        value = self.example.split(" +-")[0]
        return f"'{self.example}', 'below {value}', 'above {value}' or '{value} to ...'"


Length = Annotated[Range, _RangeOf("length", "100 mm +- 10 %")]

_HOP: frozenset[Mode] = frozenset({"hop"})
_CLAMPED: frozenset[Mode] = frozenset({"clamped"})
_RELEASED: frozenset[Mode] = frozenset({"decay", "drop"})

EXPECTED: dict[str, tuple[str, frozenset[Mode]]] = {
    "distance": ("distance_m", _HOP),
    "hop_height": ("hop_height_m", _HOP),
    "amplitude": ("amplitude_m", _CLAMPED),
    "phase": ("phase_rad", _CLAMPED),
    "speed": ("speed_rad_s", _HOP | _CLAMPED),
    "displacement": ("displacement_m", _RELEASED),
    "ring": ("ring_hz", _RELEASED),
    "damping_ratio": ("damping_ratio", _RELEASED),
    "twin_error": ("error_mm", _HOP | _CLAMPED | _RELEASED),
}
"""Key -> the result that it is about, and the modes whose runs have it."""

_UNITS = {"ring": 1 / math.tau, "twin_error": 1e3}
"""Key -> unit of its result over SI: results are in Hz and mm there."""


class Expectation(Section):
    """Ranges that results of a run must lie in; outside of one the run fails."""

    distance: Length | None = None
    """Forward travel of the foot."""
    hop_height: Length | None = None
    amplitude: Length | None = None
    """Of T, forward, at the rotor's speed."""
    phase: Annotated[Range, _RangeOf("angle", "90 deg +- 10 deg")] | None = None
    """By which T follows the rotor's pull, -180 deg to 180 deg."""
    speed: Annotated[Range, _RangeOf("speed", "17 rad/s +- 0.3 rad/s")] | None = None
    """Mean speed of the rotor as measured."""
    displacement: Length | None = None
    """Of the released point, from the release to its rest."""
    ring: Annotated[Range, _RangeOf("speed", "1.6 Hz +- 2 %")] | None = None
    """Frequency of the ring-down."""
    damping_ratio: Annotated[Range, _RangeOf("ratio", "0.4 % +- 20 %")] | None = None
    """Of the ring-down."""
    twin_error: Annotated[Range, _RangeOf("length", "3 mm +- 1 mm")] | None = None
    """Root mean square distance between robot and twin; usually `below 3 mm`."""

    def ranges(self) -> dict[str, Range]:
        """Return the ranges by the name of their result, in the units of the results."""
        found = {}
        for key, (name, _) in EXPECTED.items():
            one: Range | None = getattr(self, key)
            if one is not None:
                factor = _UNITS.get(key, 1.0)
                found[name] = Range(*(None if end is None else factor * end for end in one))
        return found

    def wrong_for(self, mode: Mode) -> str | None:
        """Return what is expected that runs of a mode do not have, in words, or None."""
        for key, (_, modes) in EXPECTED.items():
            if getattr(self, key) is not None and mode not in modes:
                fit = [name for name, (_, of) in EXPECTED.items() if mode in of]
                return f"expect: mode {mode} has no {key}; it has {', '.join(fit)}"
        return None
