"""What changes from run to run of one condition: control charts of individual values.

Limits are those of D. C. Montgomery, *Introduction to Statistical Quality Control*, 7th ed. 2013,
section 6.4, and of the NIST/SEMATECH *e-Handbook of Statistical Methods*, 6.3.2.2: the spread of
single values is estimated from the mean of their moving ranges over two, divided by d2 = 1.128, so
that a slow drift does not widen it; limits are three standard deviations about the mean.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.catalogue.entry import Entry

__all__ = [
    "ControlLimits",
    "Trend",
    "TrendCondition",
    "beside_earlier",
    "charted",
    "condition_of",
    "conditions",
    "individuals",
    "trends",
]

_D2 = 1.128  # expected range of two values over their standard deviation
_WIDTH = 3.0  # standard deviations
_BASELINE = 25  # values that set the limits, as both books advise; later ones are judged by them
_LEAST = 5
_SLACK = 1e-9  # relative: equal values differ from their mean by rounding
_LAST = 10  # runs that a report compares with
_SIDE = 8  # in a row on one side of the mean: Western Electric's fourth rule


class TrendCondition(NamedTuple):
    """What runs have to share to be compared: the robot, and what was asked of it."""

    protocol: str
    mode: str
    speed: float | None
    model: str
    shape: str

    def __str__(self) -> str:
        """Return it for a heading."""
        speed = "" if self.speed is None else f" at {self.speed:g} rad/s"
        where = f", {self.protocol}" if self.protocol else ""
        return f"{self.mode}{speed}{where}, {self.model} with {self.shape}"


class ControlLimits(NamedTuple):
    """Mean and control limits, in the unit of the values."""

    lower: float
    centre: float
    upper: float


@dataclass(frozen=True, eq=False)
class Trend:
    """One quantity over the runs of a condition, oldest first.

    Args:
        title: of the quantity.
        unit: of its values.
        names: (n,) of the runs.
        values: (n,) [`unit`].
        limits: None for less than five runs.
        signals: (n,) True outside the limits, or at the end of eight in a row on one side.
        each: what a value belongs to.
    """

    title: str
    unit: str
    names: tuple[str, ...]
    values: NDArray[np.float64]
    limits: ControlLimits | None
    signals: NDArray[np.bool_]
    each: str = "run"


def charted(title: str, unit: str, values: Mapping[str, float], each: str = "run") -> list[Trend]:
    """Return the trend of named values in the order of time, none of less than two.

    Args:
        title: of the quantity.
        unit: of its values.
        values: name -> value, oldest first.
        each: what a value belongs to.
    """
    given = {name: value for name, value in values.items() if np.isfinite(value)}
    if len(given) < 2:
        return []
    numbers = np.array([*given.values()])
    limits = individuals(numbers)
    return [Trend(title, unit, tuple(given), numbers, limits, _signals(numbers, limits), each)]


def individuals(values: NDArray[np.float64]) -> ControlLimits | None:
    """Return the limits of an individuals chart, from the first 25 values; None for less than five.

    Values outside their own limits are left out, and the limits calculated again (Montgomery, 6.2).

    Args:
        values: (n,) in the order of time [any unit].
    """
    first = values[:_BASELINE]
    while len(first) >= _LEAST:
        centre = float(first.mean())
        reach = _WIDTH * float(np.abs(np.diff(first)).mean()) / _D2
        limits = ControlLimits(centre - reach, centre, centre + reach)
        outside = _outside(first, limits)
        if not outside.any():
            return limits
        first = first[~outside]
    return None


def _outside(values: NDArray[np.float64], limits: ControlLimits) -> NDArray[np.bool_]:
    slack = _SLACK * abs(limits.centre)
    return (values < limits.lower - slack) | (values > limits.upper + slack)


def condition_of(entry: Entry) -> TrendCondition | None:
    """Return the condition of a run, None where it has no number to compare."""
    if entry.slowest != entry.fastest or not entry.mode:
        return None
    speed = None if entry.fastest is None else round(entry.fastest, 1)
    return TrendCondition(entry.protocol, entry.mode, speed, entry.model, entry.shape)


def conditions(entries: Iterable[Entry]) -> dict[TrendCondition, list[Entry]]:
    """Return the complete runs that nobody called bad by their conditions, oldest first."""
    found: dict[TrendCondition, list[Entry]] = {}
    for entry in sorted(entries, key=lambda one: (one.created, one.name)):
        condition = condition_of(entry)
        if condition is not None and entry.status == "complete" and entry.verdict != "bad":
            found.setdefault(condition, []).append(entry)
    return found


def trends(runs: Sequence[Entry]) -> list[Trend]:
    """Return the trend of each quantity that at least two runs of a condition have."""
    facts = [json.loads(run.facts) for run in runs]
    found = []
    for title, unit, read in _QUANTITIES:
        pairs = {run.name: read(run, fact) for run, fact in zip(runs, facts, strict=True)}
        given = {name: float(value) for name, value in pairs.items() if value is not None}
        found += charted(title, unit, given)
    return found


def beside_earlier(entries: Sequence[Entry], name: str) -> str:
    """Return in one sentence how a run compares with the last runs of its condition.

    Error of the twin and distance against the range of up to ten runs before it; where these give
    control limits, whether it is outside them. Empty where there is no run before.
    """
    run = next((entry for entry in entries if entry.name == name), None)
    condition = None if run is None else condition_of(run)
    if run is None or condition is None:
        return ""
    earlier = [
        entry
        for entry in conditions(entries).get(condition, [])
        if (entry.created, entry.name) < (run.created, run.name)
    ][-_LAST:]
    parts, outside = [], []
    for title, unit, scale, read in _JUDGED:
        values = np.array([scale * v for v in map(read, earlier) if v is not None])
        value = read(run)
        if value is None or not len(values):
            continue
        parts.append(
            f"{title} {scale * value:.1f} {unit} (before: {values.min():.1f} to {values.max():.1f})"
        )
        limits = individuals(values)
        if limits is not None and _outside(np.array([scale * value]), limits).any():
            outside.append(title)
    if not parts:
        return ""
    count = f"{len(earlier)} runs" if len(earlier) > 1 else "run"
    verdict = f"; outside the control limits: {' and '.join(outside)}" if outside else ""
    return f"Beside the last {count} of the same condition: {', '.join(parts)}{verdict}."


def _signals(values: NDArray[np.float64], limits: ControlLimits | None) -> NDArray[np.bool_]:
    if limits is None:
        return np.zeros(len(values), dtype=bool)
    off = values - limits.centre
    side = np.where(np.abs(off) > _SLACK * abs(limits.centre), np.sign(off), 0.0)
    sums = np.convolve(side, np.ones(_SIDE))[: len(values)]
    return _outside(values, limits) | (np.abs(sums) == _SIDE)


def _real(name: str) -> Callable[[Entry, Mapping[str, Any]], float | None]:
    return lambda _, facts: (facts.get("real") or {}).get(name)


def _off_speed(entry: Entry, _: Mapping[str, Any]) -> float | None:
    return entry.rotor and entry.fastest and 100 * (entry.rotor / entry.fastest - 1)


_QUANTITIES: tuple[tuple[str, str, Callable[[Entry, Mapping[str, Any]], float | None]], ...] = (
    ("Error of the twin", "mm", lambda entry, _: entry.error),
    ("Distance", "m", lambda entry, _: entry.distance),
    ("Hop height", "m", _real("hop_height_m")),
    ("Rotor speed, measured against asked for", "%", _off_speed),
    ("Natural frequency after release", "Hz", _real("ring_hz")),
    ("Damping ratio after release", "", _real("damping_ratio")),
    ("Camera noise of T", "mm", lambda entry, _: entry.noise),
)
_JUDGED: tuple[tuple[str, str, float, Callable[[Entry], float | None]], ...] = (
    ("error of the twin", "mm", 1.0, lambda entry: entry.error),
    ("distance", "mm", 1e3, lambda entry: entry.distance),
)
