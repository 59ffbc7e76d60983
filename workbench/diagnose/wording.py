"""Numbers in sentences and tables for people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Amount", "digits", "together"]

_DIGITS = 3
_WRITTEN_OUT = 1e2, 1e6  # numbers between these need neither point nor power of ten


def digits(value: float) -> str:
    """Return a number with three digits that count, written out unless it is very small or large.

    Args:
        value: in any unit.
    """
    if not value:
        return "0"
    rounded = float(f"{value:.{_DIGITS}g}")
    if _WRITTEN_OUT[0] <= abs(rounded) < _WRITTEN_OUT[1]:
        return f"{rounded:.0f}"
    return f"{value:#.{_DIGITS}g}"


def together(names: Sequence[str]) -> str:
    """Return causes that act together: "a with b", "a, b and c"."""
    if len(names) < 3:
        return " with ".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


@dataclass(frozen=True)
class Amount:
    """A quantity in the sentence of a cause.

    `{mass}` is its value, `{mass:size}` how large it is whatever its sign, and
    `{mass:heavier|lighter}` the word for its sign.

    Args:
        value: in its unit; shares are given in percent.
        low: of its 90 % interval.
        high: of its 90 % interval.
        unit: SI.
    """

    value: float
    low: float
    high: float
    unit: str

    def __format__(self, spec: str) -> str:
        """Return it, its size or a word."""
        plus, either, minus = spec.partition("|")
        if either:
            return minus if self.value < 0 else plus
        value, low, high, unit = self.displayed
        if spec == "size" and value < 0:
            value, low, high = -value, -high, -low
        again = " %" if unit == "%" else ""
        return f"{digits(value)} {unit} ({digits(low)} to {digits(high)}{again})"

    @property
    def displayed(self) -> tuple[float, float, float, str]:
        """Return value, interval and unit as people read them: shares in percent."""
        if self.unit == "1":
            return 100 * self.value, 100 * self.low, 100 * self.high, "%"
        return self.value, self.low, self.high, self.unit
