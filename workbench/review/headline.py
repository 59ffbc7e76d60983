"""The numbers that a reader looks for first, as text with units and sensible digits."""

from __future__ import annotations

import math
from typing import NamedTuple

from workbench.motion import Misfit
from workbench.review.comparison import Comparison

__all__ = ["HEADINGS", "HeadlineRow", "headline", "misfit_rows", "verdict"]

HEADINGS = ("", "Real", "Twin", "Difference")
_UNKNOWN = "not measured"


class HeadlineRow(NamedTuple):
    """One quantity of the run beside its twin; the difference is twin minus real."""

    quantity: str
    real: str
    twin: str
    difference: str


def headline(comparison: Comparison) -> list[HeadlineRow]:
    """Return distance, hop height and rotor speed of robot and twin."""
    real, twin = comparison.real_summary, comparison.twin_summary
    return [
        _row("Distance", real.distance_m, twin.distance_m, "m", digits=3),
        _row("Hop height", 1e3 * real.hop_height_m, 1e3 * twin.hop_height_m, "mm", digits=1),
        _row("Rotor speed", real.speed_rad_s, twin.speed_rad_s, "rad/s", digits=2),
    ]


def misfit_rows(misfit: Misfit) -> list[tuple[str, str]]:
    """Return the root mean square errors of foot, T and both."""
    return [
        ("foot", _quantity(misfit.foot_mm, "mm", 1)),
        ("T", _quantity(misfit.top_mm, "mm", 1)),
        ("foot and T", _quantity(misfit.both_mm, "mm", 1)),
    ]


def verdict(comparison: Comparison) -> str:
    """Say in one sentence how far the robot and its twin went and how far apart they were."""
    real, twin = comparison.real_summary.distance_m, comparison.twin_summary.distance_m
    if not math.isfinite(real + twin + comparison.misfit.both_mm):
        return "Too little of the run was seen to compare the robot with its twin."
    return (
        f"In {comparison.duration_s:g} s the robot travelled {_quantity(real, 'm', 3)} and its "
        f"twin {_quantity(twin, 'm', 3)}; over that time they were "
        f"{_quantity(comparison.misfit.both_mm, 'mm', 1)} apart (root mean square of foot and T)."
    )


def _row(name: str, real: float, twin: float, unit: str, digits: int) -> HeadlineRow:
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
