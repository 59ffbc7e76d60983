"""Several runs in one recording: a lane and a tab for each, and all of them side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.motion import FOOT
from workbench.review import palette
from workbench.review.comparison import Comparison
from workbench.review.layout import curves, run_views, scene, time_panel
from workbench.review.palette import rgb
from workbench.review.scene import floor_height

__all__ = ["draw_lane", "lane_label", "lanes"]

_WIDTH_M = 0.40  # from lane to lane: a foot and room to fall over
_SIGN_M = 0.24  # from the start back to the lane's sign
_LINE = 1.5


def lanes(comparisons: Sequence[Comparison]) -> rrb.Blueprint:
    """Return a tab with all runs and one for each run; the tree of entities stands beside them."""
    tabs = [
        run_views(comparison, f"/runs/{number}", lane_label(comparison, number))
        for number, comparison in enumerate(comparisons, start=1)
    ]
    return rrb.Blueprint(
        rrb.Tabs(_all(comparisons), *tabs, active_tab=0),
        rrb.BlueprintPanel(state="expanded"),
        rrb.SelectionPanel(state="collapsed"),
        time_panel(),
    )


def lane_label(comparison: Comparison, number: int) -> str:
    """Return what a lane and its tab are called."""
    return f"{number}: {comparison.label}"


def draw_lane(stream: rr.RecordingStream, comparison: Comparison, number: int) -> None:
    """Put a run's entities into its lane, the first one nearest to the eye, with its sign."""
    root = f"runs/{number}"
    stream.log(root, rr.Transform3D(translation=[0, (number - 1) * _WIDTH_M, 0]), static=True)
    place = [-_SIGN_M, 0.0, floor_height(comparison)]
    sign = rr.Points3D(
        [place],
        labels=[lane_label(comparison, number)],
        radii=0.0001,
        colors=rgb(palette.run_color(number)),
    )
    stream.log(f"{root}/sign", sign, static=True)


def _all(comparisons: Sequence[Comparison]) -> rrb.Container:
    """Return all runs: their robots in lanes, their ways, their errors and a table."""
    plots = {
        "Foot of the robots, forward x [m]": "foot_x/real",
        "Foot of the twins, forward x [m]": "foot_x/twin",
        "Distance of T from its twin [mm]": "error_mm/top",
    }
    return rrb.Vertical(
        rrb.Horizontal(
            _race(comparisons),
            rrb.TextDocumentView(origin="/notes", name="Runs"),
            column_shares=[2, 1],
        ),
        rrb.Horizontal(*(_overlaid(name, plot, comparisons) for name, plot in plots.items())),
        row_shares=[3, 2],
        name="All runs",
    )


def _race(comparisons: Sequence[Comparison]) -> rrb.Spatial3DView:
    parts = ("real/**", "sim/**", "extended/**", "sign", "floor/**")
    contents = [
        f"/runs/{number}/{part}" for number in range(1, len(comparisons) + 1) for part in parts
    ]
    floor = min(floor_height(comparison) for comparison in comparisons)
    return scene("All robots, a lane for each run", "", contents, _eye(comparisons), floor)


def _eye(comparisons: Sequence[Comparison]) -> rrb.EyeControls3D:
    """Look over all lanes from the right and from above."""
    reaches = [comparison.reach() for comparison in comparisons]
    left = min(start for start, _ in reaches) - 2 * _SIGN_M
    right = max(end for _, end in reaches) + _SIGN_M
    deep = (len(comparisons) - 1) * _WIDTH_M
    target = np.array([(left + right) / 2, deep / 2, 0.1])
    seen = max((right - left) / 1.7, 0.5) + 0.55 * deep
    return rrb.EyeControls3D(
        kind="Orbital",
        position=target + seen * 1.35 * np.array([0.1, -0.78, 0.62]),
        look_target=target,
        eye_up=(0, 0, 1),
    )


def _overlaid(name: str, plot: str, comparisons: Sequence[Comparison]) -> rrb.TimeSeriesView:
    """Return one curve of every run, told apart by the colours of the runs."""
    styles = {
        f"/runs/{number}/plots/{plot}": rr.SeriesLines(
            names=lane_label(comparison, number),
            colors=rgb(palette.run_color(number)),
            widths=_LINE,
        )
        for number, comparison in enumerate(comparisons, start=1)
    }
    legend = plot == "foot_x/real"
    channel = FOOT[0] if plot.startswith(FOOT[0][:6]) else None
    span = None if channel is None else _span(comparisons, channel)
    return curves("/runs", name, legend, span, list(styles), styles)


def _span(comparisons: Sequence[Comparison], channel: str) -> tuple[float, float] | None:
    """Return what all robots and twins reach, so that both plots have one axis."""
    ways = [
        motion[channel][motion.validity(channel)]
        for comparison in comparisons
        for motion in (comparison.real, comparison.twin)
    ]
    seen = np.concatenate(ways)
    if not len(seen) or np.ptp(seen) == 0:
        return None
    air = 0.08 * np.ptp(seen)
    return float(seen.min() - air), float(seen.max() + air)
