"""Numbers in sentences and tables for people."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Amount", "digits"]

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


@dataclass(frozen=True)
class Amount:
    """A quantity in the sentence of a cause.

    `{mass}` is its value, `{mass:size}` how large it is whatever its sign, and
    `{mass:heavier|lighter}` the word for its sign.

    Args:
        value: in its unit; shares are told in percent.
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
        numbers = self.value, self.low, self.high
        if spec == "size" and self.value < 0:
            numbers = -self.value, -self.high, -self.low
        if self.unit == "1":
            value, low, high = (digits(100 * number) for number in numbers)
            return f"{value} % ({low} to {high} %)"
        value, low, high = map(digits, numbers)
        return f"{value} {self.unit} ({low} to {high})"
