"""Numbers in sentences and tables for people."""

from __future__ import annotations

__all__ = ["digits"]

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
