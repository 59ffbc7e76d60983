"""Runs of one condition together: what robot and twin did, with intervals over the repeats."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from workbench.report.comparison import Comparison

__all__ = ["CONFIDENCE", "MeanInterval", "RepeatedRuns", "conditions", "mean_interval"]

CONFIDENCE = 0.90


class MeanInterval(NamedTuple):
    """The mean of repeats.

    Args:
        mean: of those that are known; NaN of none.
        half: half the width of its interval; NaN where fewer than two are known.
        known: how many are known.
    """

    mean: float
    half: float
    known: int


class RepeatedRuns(NamedTuple):
    """Runs that differ in their repeat only.

    Args:
        name: what they have in common and other conditions have not.
        runs: in the order of the experiment.
    """

    name: str
    runs: tuple[Comparison, ...]

    def interval(self, value: Callable[[Comparison], float]) -> MeanInterval:
        """Return the spread of a number over the whole runs; marked ones do not count."""
        return mean_interval([value(run) for run in self.runs if run.mark is None])


def conditions(comparisons: Sequence[Comparison]) -> list[RepeatedRuns]:
    """Return the conditions, sorted by their labels, numbers in them by their size."""
    found: dict[tuple[str, ...], list[Comparison]] = {}
    for run in comparisons:
        label = tuple(part for part in run.label if not part.startswith("repeat "))
        found.setdefault(label or (run.title,), []).append(run)
    same = set.intersection(*map(set, found)) if len(found) > 1 else set()
    return [
        RepeatedRuns(", ".join(part for part in common if part not in same), tuple(found[common]))
        for common in sorted(found, key=_order)
    ]


def _order(label: Sequence[str]) -> list[tuple[str, float, str]]:
    """Return what sorts labels by their words, and equal units by their numbers."""
    parts = [re.match(r"(-?[\d.]*)\s*(.*)", part) for part in label]
    return [(m[2], float(m[1].strip(".") or 0), m[0]) for m in parts if m is not None]


def mean_interval(values: Sequence[float]) -> MeanInterval:
    """Return mean and interval of repeats, by Student's t; what is not finite does not count."""
    known = [value for value in values if math.isfinite(value)]
    if len(known) < 2:
        return MeanInterval(known[0] if known else math.nan, math.nan, len(known))
    factor = float(scipy.stats.t.ppf((1 + CONFIDENCE) / 2, len(known) - 1))
    half = factor * float(np.std(known, ddof=1)) / math.sqrt(len(known))
    return MeanInterval(float(np.mean(known)), half, len(known))
