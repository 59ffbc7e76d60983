"""The figures of an experiment: paths of all repeats, distances as bars, a thumbnail for each run.

The paths have the form of the thesis' figures 6.5 and 6.6: the simulation on the left, the robot on
the right, every panel on the same axes; the bars that of figure 6.7, with the twins beside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.quantities import DisplayedQuantity
from workbench.report import palette
from workbench.report.comparison import Comparison
from workbench.report.drawing import as_svg, drawn, legend
from workbench.report.plots import seen
from workbench.report.repeats import RepeatedRuns
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["bars", "paths", "thumbnail"]

_PANEL_IN = 1.25
_BARS_IN = 2.8
_LINE = 0.9
_FADED = 0.75
_SIZE = (180, 48)  # of a thumbnail, in units of its own
_INSET = 3.0


def paths(conditions: Sequence[RepeatedRuns]) -> str:
    """Draw the paths of all repeats in x-z, a row a condition, simulated left and real right."""

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(conditions), 2, sharex=True, sharey=True, squeeze=False)
        for (left, right), condition in zip(rows, conditions, strict=True):
            for run in condition.runs:
                _path(left, run, run.twin, palette.TWIN)
                _path(right, run, run.real, palette.REAL)
            left.set(title=f"Simulated: {condition.name}", ylabel="z [m]")
            right.set(title=f"Real: {condition.name}")
        for ax in rows[-1]:
            ax.set_xlabel("x [m]")

    return as_svg(drawn(draw, 0.4 + _PANEL_IN * len(conditions)), "paths")


def bars(conditions: Sequence[RepeatedRuns], quantity: str, display: DisplayedQuantity) -> str:
    """Draw the mean of a summary's number, robot beside twin, with intervals and every run."""
    name, unit, factor, _ = display
    sides = {
        "real": (-0.2, palette.REAL, lambda run: run.real_summary),
        "twin": (0.2, palette.TWIN, lambda run: run.twin_summary),
    }

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        at = np.arange(len(conditions), dtype=float)
        for label, (shift, color, summary) in sides.items():

            def value(run: Comparison, of: Callable[[Comparison], object] = summary) -> float:
                return factor * float(getattr(of(run), quantity, np.nan))

            intervals = [condition.interval(value) for condition in conditions]
            means = np.nan_to_num([one.mean for one in intervals])
            ax.bar(at + shift, means, 0.36, color=color, alpha=_FADED, label=label)
            ax.errorbar(
                at + shift, means, [one.half for one in intervals], fmt="none", ecolor="#010203",
                capsize=3, elinewidth=1,
            )  # fmt: skip
            for x, condition in zip(at + shift, conditions, strict=True):
                values = [value(run) for run in condition.runs if run.mark is None]
                ax.plot(np.full(len(values), x), values, ".", color="#010203", markersize=4)
        ax.set_xticks(at, [condition.name.replace(", ", "\n") for condition in conditions])
        ax.set_ylabel(f"{name.lower()} [{unit}]" if unit else name.lower())
        ax.grid(axis="x", visible=False)
        legend(ax)

    return as_svg(drawn(draw, _BARS_IN), "bars")


def thumbnail(comparison: Comparison) -> str:
    """Draw the paths of robot and twin as a small picture without axes, as an `<svg>`."""
    ways = [
        (_way(comparison, motion), color)
        for motion, color in ((comparison.real, palette.REAL), (comparison.twin, palette.TWIN))
    ]
    points = np.concatenate([way for way, _ in ways])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return ""
    low, span = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-3)
    lines = "".join(
        f'<polyline fill="none" stroke="{color}" stroke-width="1.2" points="{drawn_points}"/>'
        for way, color in ways
        for drawn_points in _strokes((way - low) / span)
    )
    width, height = _SIZE
    return f'<svg class="thumbnail" viewBox="0 0 {width} {height}" role="img">{lines}</svg>'


def _path(ax: Axes, run: Comparison, motion: TimeSeries, color: str) -> None:
    way = _way(run, motion)
    ax.plot(way[:, 0], way[:, 1], color=color, linewidth=_LINE, alpha=_FADED)


def _way(run: Comparison, motion: TimeSeries) -> NDArray[np.float64]:
    """Return x and z of the point that shows most, (n, 2) [m], NaN where it was not seen."""
    x, _, z = run.mover
    moving = motion.between(0.0, run.duration_s)
    return np.column_stack([seen(moving, x), seen(moving, z)])


def _strokes(way: NDArray[np.float64]) -> list[str]:
    """Return the points of every unbroken part of a way within 0 to 1, for a thumbnail."""
    width, height = (size - 2 * _INSET for size in _SIZE)
    known = np.isfinite(way.sum(axis=1))
    parts = np.split(np.arange(len(way)), np.flatnonzero(known[1:] != known[:-1]) + 1)
    return [
        " ".join(f"{_INSET + width * x:.1f},{_INSET + height * (1 - z):.1f}" for x, z in way[part])
        for part in parts
        if len(part) > 1 and known[part].all()
    ]
