"""What a cleaning recipe is and what it reports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

from workbench.timeseries import TimeSeries
from workbench.tracking.bodies import RawPoints

__all__ = ["BodyReport", "CleaningReport", "Recipe"]


@dataclass(frozen=True)
class BodyReport:
    """What cleaning did to one body, in samples.

    Args:
        source: which numbers of the take its position was made of.
        held: the sample before was repeated.
        filled: interpolated.
        rejected: seen, but not believed.
        missing_left: still unknown afterwards.
    """

    source: str
    held: int = 0
    filled: int = 0
    rejected: int = 0
    missing_left: int = 0


@dataclass(frozen=True)
class CleaningReport:
    """What a recipe did.

    Args:
        recipe: its name.
        bodies: by role: foot, top, rotor.
        filter: the low-pass in words.
        unfiltered: samples in stretches too short for the filter, over all columns.
        origin_m: the base that the recipe subtracted itself, or None.
        warnings: what the user should know.
    """

    recipe: str
    bodies: dict[str, BodyReport]
    filter: str
    unfiltered: int = 0
    origin_m: tuple[float, float, float] | None = None
    warnings: tuple[str, ...] = field(default=())

    def as_json(self) -> dict[str, Any]:
        """Return plain dicts and lists."""
        plain = asdict(self)
        plain["warnings"] = list(self.warnings)
        plain["origin_m"] = None if self.origin_m is None else list(self.origin_m)
        return plain


Recipe = Callable[[RawPoints], tuple[TimeSeries, CleaningReport]]
"""Turns raw points into evenly sampled columns FOOT, TOP, ROTOR and perhaps PITCH."""
