"""The numbers that a reader looks for first, as text with units and sensible digits."""

from __future__ import annotations

import math
from typing import NamedTuple

from workbench.motion import Misfit, Summary
from workbench.quantities import QUANTITIES, Quantity
from workbench.review.comparison import Comparison
from workbench.ringdown import RingDown

__all__ = [
    "HEADINGS",
    "HeadlineRow",
    "headline",
    "largest_rows",
    "misfit_rows",
    "prediction_rows",
    "verdict",
]

HEADINGS = ("", "Real", "Twin", "Difference")
_UNKNOWN = "not measured"


class HeadlineRow(NamedTuple):
    """One quantity of the run beside its twin; the difference is twin minus real."""

    quantity: str
    real: str
    twin: str
    difference: str


def headline(comparison: Comparison) -> list[HeadlineRow]:
    """Return the numbers of robot and twin: those of a drive or those of a release."""
    real, twin = comparison.real_summary.as_json(), comparison.twin_summary.as_json()
    return [
        _row(quantity, quantity.factor * real[key], quantity.factor * twin[key])
        for key, quantity in QUANTITIES.items()
        if key in real
    ]


def misfit_rows(misfit: Misfit) -> list[tuple[str, str]]:
    """Return the root mean square errors of foot, T and both."""
    return [
        ("foot", _quantity(misfit.foot_mm, "mm", 1)),
        ("T", _quantity(misfit.top_mm, "mm", 1)),
        ("foot and T", _quantity(misfit.both_mm, "mm", 1)),
    ]


def prediction_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """Return how far the model is off so long after the estimated state, last freely."""
    if not comparison.predictions:
        return []
    measured = "turned as measured" if comparison.driven else "released as measured"
    told = [
        (
            f"{seconds:g} s ahead, from the estimated state"
            if math.isfinite(seconds)
            else f"Free simulation, {measured}",
            _quantity(mm, "mm", 1 if mm >= 10 else 2),
        )
        for seconds, mm in comparison.predictions
    ]
    foot = comparison.mode in ("hop", "drop")
    free = _quantity(comparison.misfit.both_mm if foot else comparison.misfit.top_mm, "mm", 1)
    asked = "turned as commanded" if comparison.driven else "the twin's release"
    return [*told, (f"Free simulation, {asked}", free)]


def largest_rows(comparison: Comparison) -> list[tuple[str, str, str, str]]:
    """Return the greatest plotted distance of foot and T, with its time, as rows of a headline."""
    return [
        (f"Largest error, {name}", "", "", f"{at.mm:.1f} mm at {at.time_s:.2f} s")
        for name, at in comparison.largest_error().items()
    ]


def verdict(comparison: Comparison) -> str:
    """Say in one sentence what the robot and its twin did and how far apart they were."""
    match comparison.real_summary, comparison.twin_summary:
        case (Summary(distance_m=real), Summary(distance_m=twin)):
            told = f"In {comparison.duration_s:g} s the robot travelled {_quantity(real, 'm', 3)} "
            told += f"and its twin {_quantity(twin, 'm', 3)}"
        case (RingDown(ring_hz=real), RingDown(ring_hz=twin)):
            told = f"Let go, the robot rang at {_quantity(real, 'Hz', 3)} "
            told += f"and its twin at {_quantity(twin, 'Hz', 3)}"
        case _:
            raise TypeError("robot and twin are summarized in different ways")
    if comparison.mark is not None:
        return f"{comparison.mark}. What is left of it is shown."
    if not math.isfinite(real + twin + comparison.misfit.both_mm):
        return "Too little of the run was seen to compare the robot with its twin."
    apart = _quantity(comparison.misfit.both_mm, "mm", 1)
    return f"{told}; over that time they were {apart} apart (root mean square of foot and T)."


def _row(quantity: Quantity, real: float, twin: float) -> HeadlineRow:
    name, unit, _, digits = quantity
    gap = twin - real
    share = f" ({100 * gap / abs(real):+.0f} %)" if _comparable(real, gap) else ""
    difference = f"{gap:+.{digits}f} {unit}{share}" if math.isfinite(gap) else "-"
    return HeadlineRow(
        name, _quantity(real, unit, digits), _quantity(twin, unit, digits), difference
    )


def _comparable(real: float, gap: float) -> bool:
    return math.isfinite(gap) and real != 0


def _quantity(value: float, unit: str, digits: int) -> str:
    return f"{value:.{digits}f} {unit}" if math.isfinite(value) else _UNKNOWN
