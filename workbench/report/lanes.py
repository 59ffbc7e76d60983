"""Several runs in one recording: a lane and a tab for each, and all of them side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.motion import FOOT, TOP
from workbench.report import palette
from workbench.report.comparison import Comparison
from workbench.report.layout import Overrides, curves, run_views, scene, time_panel
from workbench.report.notes import labels
from workbench.report.palette import rgb
from workbench.report.scene import floor_height

__all__ = ["draw_lanes", "lanes"]

_WIDTH_M = 0.40  # from lane to lane: a foot and room to fall over
_IN_A_ROW = 4
_SIGN_M = 0.24  # from the start back to the lane's sign
_LINE = 1.5
_ASPECT = 1.6  # width to height of the view
_DISTANCE = 1.35  # of the eye from what it looks at, for each metre of height seen
_LEAST_M = 0.5


def lanes(comparisons: Sequence[Comparison]) -> rrb.Blueprint:
    """Return a tab with all runs and one for each run; the tree of entities is beside them."""
    tabs = [
        run_views(comparison, f"/runs/{number}", name)
        for number, (comparison, name) in enumerate(
            zip(comparisons, _names(comparisons), strict=True), start=1
        )
    ]
    return rrb.Blueprint(
        rrb.Tabs(_all(comparisons), *tabs, active_tab=0),
        rrb.BlueprintPanel(state="expanded"),
        rrb.SelectionPanel(state="collapsed"),
        time_panel(),
    )


def draw_lanes(stream: rr.RecordingStream, comparisons: Sequence[Comparison]) -> None:
    """Put the entities of each run into its lane, the first one leftmost, its number on a sign.

    After four lanes another row begins, beyond all that the first one reaches: in one row of many
    the robots would be tiny.
    """
    start, end = _reach(comparisons)
    for number, comparison in enumerate(comparisons, start=1):
        row, lane = divmod(number - 1, _IN_A_ROW)
        root, offset = f"runs/{number}", [row * (end - start), -lane * _WIDTH_M, 0]
        stream.log(root, rr.Transform3D(translation=offset), static=True)
        sign = rr.Points3D(
            [[-_SIGN_M, 0.0, floor_height(comparison)]],
            labels=[f"{number}"],
            radii=0.0001,
            colors=rgb(palette.SHADES["marks"]),
        )
        stream.log(f"{root}/sign", sign, static=True)


def _reach(comparisons: Sequence[Comparison]) -> tuple[float, float]:
    """Return where the lanes of a row begin and end, forward [m]."""
    reaches = [comparison.reach() for comparison in comparisons]
    start, end = min(start for start, _ in reaches), max(end for _, end in reaches)
    return start - 1.5 * _SIGN_M, end + _SIGN_M


def _all(comparisons: Sequence[Comparison]) -> rrb.Container:
    """Return all runs: their robots in lanes, their ways, their errors and a table."""
    hopping = all(comparison.mover == FOOT for comparison in comparisons)
    point, channel = ("foot", FOOT[0]) if hopping else ("T", TOP[0])
    way, span = channel.removesuffix("_m"), _span(comparisons, channel)
    return rrb.Vertical(
        rrb.Horizontal(
            _race(comparisons),
            rrb.TextDocumentView(origin="/notes", name="Runs"),
            column_shares=[2, 1],
            name="Robots",
        ),
        rrb.Horizontal(
            _overlaid(f"Real {point} x [m]", f"{way}/real", comparisons, span),
            _overlaid(f"Twin {point} x [m]", f"{way}/twin", comparisons, span),
            _overlaid("T error [mm]", "error_mm/top", comparisons),
            name="Curves",
        ),
        row_shares=[3, 2],
        name="All runs",
    )


def _race(comparisons: Sequence[Comparison]) -> rrb.Spatial3DView:
    parts = ("real/**", "twin/**", "extended/**", "sign", "floor/scale", "floor/ground")
    numbers = range(1, len(comparisons) + 1)
    contents = [f"/runs/{number}/{part}" for number in numbers for part in parts]
    contents.append(f"/runs/{len(comparisons)}/floor/marks")  # of the lane nearest to the eye
    floor = min(floor_height(comparison) for comparison in comparisons)
    outline = rr.Boxes3D.from_fields(fill_mode=rr.components.FillMode.MajorWireframe)
    outlined: Overrides = {
        f"/runs/{k}/{who}/foot": outline for k in numbers for who in ("twin", "extended")
    }
    return scene("All robots", "", contents, _eye(comparisons), floor, outlined)


def _eye(comparisons: Sequence[Comparison]) -> rrb.EyeControls3D:
    """Look from the right where the way is longer than the lanes are wide, else from behind."""
    start, end = _reach(comparisons)
    count = len(comparisons)
    rows, across = -(-count // _IN_A_ROW), min(count, _IN_A_ROW) * _WIDTH_M
    along = rows * (end - start)
    target = np.array([start + along / 2, (_WIDTH_M - across) / 2, 0.1])
    sideways = along > across and rows == 1
    wide, far = (along, across) if sideways else (across, along)
    direction = np.array([0.1, -0.8, 0.6] if sideways else [-0.8, -0.1, 0.6])
    return rrb.EyeControls3D(
        kind="Orbital",
        position=target + _DISTANCE * max(wide / _ASPECT, 0.8 * far, _LEAST_M) * direction,
        look_target=target,
        eye_up=(0, 0, 1),
    )


def _names(comparisons: Sequence[Comparison]) -> list[str]:
    """Return what the runs' tabs and curves are called."""
    return [f"{number}: {label}" for number, label in enumerate(labels(comparisons), start=1)]


def _overlaid(
    name: str, plot: str, comparisons: Sequence[Comparison], span: tuple[float, float] | None = None
) -> rrb.TimeSeriesView:
    """Return one curve of every run, distinguished by the colours of the runs."""
    styles: Overrides = {
        f"/runs/{number}/plots/{plot}": rr.SeriesLines(
            names=name, colors=rgb(palette.run_color(number)), widths=_LINE
        )
        for number, name in enumerate(_names(comparisons), start=1)
    }
    legend = plot.endswith("/real")
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
