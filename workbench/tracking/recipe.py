"""The interface of a cleaning recipe: its result and its report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.timeseries import TimeSeries
from workbench.tracking.bodies import RawPoints

__all__ = ["BodyReport", "Cleaned", "CleaningReport", "Recipe", "advancing"]


@dataclass(frozen=True)
class BodyReport:
    """Samples of one body that cleaning changed.

    Args:
        source: data of the take that its position was computed from.
        held: the sample before was repeated.
        filled: interpolated.
        rejected: seen, but rejected as a glitch.
        missing_left: still unknown afterwards.
    """

    source: str
    held: int = 0
    filled: int = 0
    rejected: int = 0
    missing_left: int = 0


@dataclass(frozen=True)
class CleaningReport:
    """Report of a recipe.

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


@dataclass(frozen=True, eq=False)
class Cleaned:
    """Result of a recipe.

    Args:
        columns: k even samples of FOOT, TOP, ROTOR and perhaps PITCH.
        missing: by role, (k,) values of `SampleStatus`: why a sample of `columns` was not seen;
            FILLED where the recipe gave it a value all the same.
        raw_missing: by role, (m,) the same for the take's own samples that `advancing` keeps,
            GLITCH where the recipe rejected one.
        report: of the recipe.
    """

    columns: TimeSeries
    missing: dict[str, NDArray[np.int8]]
    raw_missing: dict[str, NDArray[np.int8]]
    report: CleaningReport


Recipe = Callable[[RawPoints], Cleaned]
"""Turns raw points into evenly sampled columns, with the reason for each sample not seen."""


def advancing(times: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the samples later than all before, (m,); rewritten files repeat frames.

    Args:
        times: (n,) [s].
    """
    given = np.where(np.isfinite(times), times, -np.inf)
    before = np.concatenate(([-np.inf], np.maximum.accumulate(given)[:-1]))
    return np.flatnonzero(given > before)
