"""What an answer lists: causes with their quantities, alternatives, and what a fit changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.diagnose.wording import Amount

__all__ = ["Alternative", "Cause", "EstimatedQuantity", "Refit", "quantity_of"]

_T90 = 1.645  # standard errors to either side of a 90 % interval


@dataclass(frozen=True)
class EstimatedQuantity(Amount):
    """One quantity of a cause, SI, with its 90 % interval and its standard error."""

    error: float

    def as_json(self) -> dict[str, Any]:
        """Return value, interval and unit."""
        return {"value": self.value, "interval90": [self.low, self.high], "unit": self.unit}


@dataclass(frozen=True)
class Cause:
    """A cause that an answer lists.

    Args:
        name: canonical.
        quantities: what was found of each.
        sentence: what a technician reads, with its numbers.
        separated_by: what separates it from others, in words.
    """

    name: str
    quantities: Mapping[str, EstimatedQuantity]
    sentence: str
    separated_by: str = ""


@dataclass(frozen=True)
class Alternative:
    """A candidate that was not taken, and why."""

    name: str
    why_not: str


@dataclass(frozen=True)
class Refit:
    """A number of the model as stated and as the fit has it, SI.

    Args:
        name: of the number.
        stated: before.
        now: after.
        low: of its 90 % interval.
        high: of its 90 % interval.
        unit: of all.
        share: of its tolerance by which it moved.
    """

    name: str
    stated: float
    now: float
    low: float
    high: float
    unit: str
    share: float

    def as_json(self) -> dict[str, Any]:
        """Return it as the command line prints it."""
        return {"stated": self.stated, "now": self.now, "interval90": [self.low, self.high],
                "unit": self.unit, "share_of_tolerance": self.share}  # fmt: skip


def quantity_of(
    value: float, error: float, low: float, high: float, unit: str
) -> EstimatedQuantity:
    """Return a quantity with its 90 % interval, within its bounds."""
    wide = _T90 * error
    return EstimatedQuantity(value, max(value - wide, low), min(value + wide, high), unit, error)
