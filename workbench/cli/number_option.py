"""Options that take a number with or without its unit: `17` and `"17 rad/s"`."""

from __future__ import annotations

import math
from collections.abc import Callable

import typer

__all__ = ["number"]


def number(
    dimension: str, unit: str, low: float = -math.inf, high: float = math.inf
) -> Callable[[str | float], float]:
    """Return a parser for a number in one unit, or a text with any unit of its dimension.

    Args:
        dimension: key of `DIMENSIONS`.
        unit: of a number without one, and of what the parser returns.
        low: least number allowed.
        high: greatest number allowed.
    """

    def parse(text: str | float) -> float:
        value = _value(text, dimension, unit)
        if not low <= value <= high:
            raise typer.BadParameter(f"{value:g} {unit} is outside {low:g} to {high:g} {unit}")
        return value

    return parse


def _value(text: str | float, dimension: str, unit: str) -> float:
    try:
        return float(text)
    except ValueError:
        from workbench.schemas import DIMENSIONS, parse_quantity  # only where a unit is typed

    try:
        return parse_quantity(text, dimension, typed=True)[0] / DIMENSIONS[dimension][unit]
    except ValueError as fault:
        raise typer.BadParameter(str(fault)) from None
