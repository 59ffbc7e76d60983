"""The numbers of what a run did: how each is called and shown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

__all__ = ["QUANTITIES", "DisplayedQuantity", "leading", "numbers_in_words", "unit_of"]


class DisplayedQuantity(NamedTuple):
    """How a number of a summary is shown.

    Args:
        name: in people's words.
        unit: that it is shown in; empty for a ratio.
        factor: from SI to that unit.
        digits: after the point.
    """

    name: str
    unit: str
    factor: float
    digits: int

    @property
    def spoken(self) -> str:
        """Return its name within a sentence: `amplitude of T`."""
        return f"{self.name[0].lower()}{self.name[1:]}"

    def number(self, value: float) -> str:
        """Return a value in SI as it is shown, without its unit."""
        return f"{self.factor * value:.{self.digits}f}"

    def text(self, value: float) -> str:
        """Return a value in SI as it is shown, with its unit."""
        return f"{self.number(value)} {self.unit}".rstrip()

    def apart(self, real: float, twin: float) -> float:
        """Return twin minus real, both in SI, in the shown unit; an angle by less than a turn."""
        gap = self.factor * (twin - real)
        return (gap + 180) % 360 - 180 if self.unit == "deg" and math.isfinite(gap) else gap


QUANTITIES: dict[str, DisplayedQuantity] = {
    "distance_m": DisplayedQuantity("Distance", "m", 1.0, 3),
    "hop_height_m": DisplayedQuantity("Hop height", "mm", 1e3, 1),
    "amplitude_m": DisplayedQuantity("Amplitude of T", "mm", 1e3, 1),
    "swing_hz": DisplayedQuantity("Frequency of T", "Hz", 1.0, 3),
    "phase_rad": DisplayedQuantity("Phase of T behind the rotor", "deg", 180 / math.pi, 1),
    "speed_rad_s": DisplayedQuantity("Rotor speed", "rad/s", 1.0, 2),
    "displacement_m": DisplayedQuantity("Displacement", "mm", 1e3, 1),
    "ring_hz": DisplayedQuantity("Ring frequency", "Hz", 1.0, 3),
    "damping_ratio": DisplayedQuantity("Damping ratio", "%", 1e2, 2),
}
"""Name of a number in a summary -> how it is shown."""

_UNITS = {
    "_rad_s": "rad/s",
    "_mm": "mm",
    "_rad": "rad",
    "_hz": "Hz",
    "_N_per_sqrt_kg": "N/sqrt(kg)",
    "_N_m": "N m",
    "_m": "m",
    "_s": "s",
    "_V": "V",
    "_A": "A",
    "_N": "N",
    "_W": "W",
}


def leading(summary: Mapping[str, float | str] | None) -> str:
    """Return the first number of a summary with its unit, `-` where there is none."""
    key = next((key for key in QUANTITIES if key in summary), None) if summary else None
    value = summary[key] if summary and key else None
    if key is None or not isinstance(value, int | float) or not math.isfinite(value):
        return "-"
    return QUANTITIES[key].text(value)


def numbers_in_words(summary: Mapping[str, Any]) -> str:
    """Return the numbers of a summary in one line: `distance 0.213 m, hop height 18.0 mm`."""
    known = ((one, summary[key]) for key, one in QUANTITIES.items() if key in summary)
    return ", ".join(f"{one.spoken} {one.text(value)}" for one, value in known)


def unit_of(name: str) -> tuple[str, str]:
    """Return the end of a name that is its unit, and the unit; twice nothing without one.

    By custom names end in their unit: `foot_x_m`, `rotor_speed_rad_s`.
    """
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return suffix, unit
    return "", ""
