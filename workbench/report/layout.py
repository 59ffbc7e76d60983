"""The layout with which the recording of a run opens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TimelineColumn

from workbench.motion import FOOT, FOOT_ERROR, TOP, TOP_ERROR
from workbench.report import palette
from workbench.report.columns import TIMELINE
from workbench.report.comparison import Comparison
from workbench.report.geometry import MISSING
from workbench.report.palette import rgb
from workbench.report.scene import floor_height
from workbench.report.texts import journal_lines

__all__ = ["Overrides", "curves", "layout", "run_views", "scene", "time_panel"]

Overrides = dict[Any, rr.Boxes3D | rr.SeriesLines]
"""Entity -> what looks other in one view than it was sent."""

_HEIGHT = 0.42  # of the scene: the robot, about 0.35 m, and a little floor
_AIR = 1.05  # of the greatest error, to the end of its axis
_ASPECT = 1.9  # width to height of what a 3-D view shows
_DISTANCE = 1.52  # of the eye from what it looks at, for each metre seen
_LEAST_M = 0.005  # of an axis: on less, a foot that is held seems to move by the noise
_SHARES = {"robots": 5.2, "curves": 4.8, "evidence": 3.4, "phases": 1.6}
"""Height of each row of views; a name is short, for the tree beside several runs is narrow."""


def layout(comparison: Comparison) -> rrb.Blueprint:
    """Return the views: robots above, curves, error and notes, and the phases below."""
    return rrb.Blueprint(run_views(comparison), time_panel(), collapse_panels=True)


def time_panel() -> rrb.TimePanel:
    """Return the panel of the timeline, which is stopped until somebody starts it."""
    return rrb.TimePanel(timeline=TIMELINE, play_state="paused", state="collapsed")


def run_views(comparison: Comparison, root: str = "", name: str | None = None) -> rrb.Container:
    """Return all views of a run; what nobody recorded has none.

    Args:
        comparison: the run.
        root: entity that holds it; empty when it is the whole recording.
        name: of the container, for its tab.
    """
    if comparison.validation is None:
        return _commanded(comparison, root, name)
    compared = rrb.Vertical(
        rrb.Horizontal(*_compared_scenes(comparison, root), name="Robots"),
        rrb.Horizontal(*_compared_errors(comparison, root), name="Errors"),
        rrb.Horizontal(*_missing(comparison, root), _words(comparison, root), name="Evidence"),
        row_shares=[_SHARES["robots"], _SHARES["curves"], _SHARES["evidence"]],
        name="As compared",
    )
    return rrb.Tabs(compared, _commanded(comparison, root, "As commanded"), active_tab=0, name=name)


def _commanded(comparison: Comparison, root: str, name: str | None) -> rrb.Container:
    """Return the run beside its twin, as the motor was commanded."""
    rows = {
        "robots": _scenes(comparison, root),
        "curves": _traces(comparison, root),
        "evidence": _evidence(comparison, root),
        "phases": _phases(comparison, root),
    }
    kept = {row: views for row, views in rows.items() if views}
    return rrb.Vertical(
        *(rrb.Horizontal(*views, name=row.capitalize()) for row, views in kept.items()),
        row_shares=[_SHARES[row] for row in kept],
        name=name,
    )


def _compared_scenes(comparison: Comparison, root: str) -> list[rrb.Spatial3DView]:
    """Return robot, base and extended model, each alone, and all three."""
    floor, eye = floor_height(comparison), _eye(comparison)
    paths = {"Real": f"{root}/real", "Base": f"{root}/compared/base",
             "Extended": f"{root}/compared/extended"}  # fmt: skip
    views = [scene(name, root, [f"{path}/**"], eye, floor) for name, path in paths.items()]
    outline = rr.Boxes3D.from_fields(fill_mode=rr.components.FillMode.MajorWireframe)
    outlined: Overrides = {f"{path}/foot": outline for path in [*paths.values()][1:]}
    every = [f"{path}/**" for path in paths.values()]
    return [*views, scene("All three", root, every, eye, floor, outlined)]


def _compared_errors(comparison: Comparison, root: str) -> list[rrb.TimeSeriesView]:
    """Return the errors of base and extended model over time, all on one axis."""
    assert comparison.validation is not None
    every = [one.error.values[one.error.valid] for _, one in comparison.validation.both]
    top = _AIR * max((float(part.max()) for part in every if part.size), default=1.0)
    named = {FOOT_ERROR: "Foot", TOP_ERROR: "T"}
    return [
        curves(
            f"{root}/plots/compared/{named[column].lower()}_mm",
            f"{named[column]} error [mm]",
            span=(0.0, top),
        )
        for column in comparison.validation.base.error.names
    ]


def _missing(comparison: Comparison, root: str) -> list[rrb.TimeSeriesView]:
    """Return the missing force over time, where the pose was estimated."""
    estimate = comparison.estimate
    if estimate is None or MISSING["top"][0] not in estimate:
        return []
    return [curves(f"{root}/plots/missing_mN", "Missing [mN]")]


def _scenes(comparison: Comparison, root: str) -> list[rrb.Spatial3DView]:
    """Return each robot alone and all together, all seen by the same eye."""
    named = zip(("Real", "Twin", "Extended twin"), ("real", "twin", "extended"), strict=True)
    moving = [pair for pair, motion in zip(named, comparison.motions, strict=False) if len(motion)]
    floor, eye = floor_height(comparison), _eye(comparison)
    views = [scene(name, root, [f"{root}/{path}/**"], eye, floor) for name, path in moving]
    if len(moving) > 1:
        together = "All three" if len(moving) > 2 else "Both robots"
        # Solid feet in one place would flicker, so those of the twins are outlines here.
        outline = rr.Boxes3D.from_fields(fill_mode=rr.components.FillMode.MajorWireframe)
        outlined: Overrides = {f"{root}/{path}/foot": outline for _, path in moving[1:]}
        paths = [f"{root}/{path}/**" for _, path in moving]
        views.append(scene(together, root, paths, eye, floor, outlined))
    return views


def scene(
    name: str,
    root: str,
    contents: Sequence[str],
    eye: rrb.EyeControls3D,
    floor_z: float,
    overrides: Overrides | None = None,
) -> rrb.Spatial3DView:
    """Return a view of robots on the ground with its grid.

    Args:
        name: of the view.
        root: entity in whose frame it is seen; empty for the whole recording.
        contents: what is shown beside the floor below `root`.
        eye: from where.
        floor_z: height of the grid [m].
        overrides: entity -> what looks other than it was sent.
    """
    floor = rr.components.Plane3D(normal=(0, 0, 1), distance=floor_z)
    return rrb.Spatial3DView(
        origin=root or "/",
        contents=[*contents, f"{root}/floor/**"],
        name=name,
        background=rrb.Background(color=rgb(palette.SHADES["sky"]), kind="SolidColor"),
        line_grid=rrb.LineGrid3D(
            visible=True,
            spacing=0.1,
            plane=floor,
            stroke_width=1.0,
            color=rgb(palette.SHADES["grid"]),
        ),
        eye_controls=eye,
        overrides=overrides,
    )


def _eye(comparison: Comparison) -> rrb.EyeControls3D:
    """Look from the right and a little above, so that forward is to the right of the picture.

    The eye does not move and sees the whole way of all robots: hops are seen against the floor.
    """
    start, end = comparison.reach()
    room = 0.6 * comparison.figure.beam_length
    left, right = start - room / 2, end + room / 2
    seen = max(_HEIGHT, (right - left) / _ASPECT)
    target = np.array([(left + right) / 2, 0.0, comparison.floor_m + 0.29 * _HEIGHT])
    return rrb.EyeControls3D(
        kind="Orbital",
        position=target + seen * _DISTANCE * np.array([0.12, -0.93, 0.34]),
        look_target=target,
        eye_up=(0, 0, 1),
    )


def _traces(comparison: Comparison, root: str) -> Sequence[rrb.Container]:
    if not any(len(motion) for motion in comparison.motions):
        return []

    def trace(plot: str, channel: str, name: str, legend: bool = False) -> rrb.TimeSeriesView:
        return curves(f"{root}/plots/{plot}", name, legend, _range(comparison, channel))

    columns = [
        rrb.Vertical(
            trace("foot_x", FOOT[0], "Foot x [m]", legend=True),
            trace("foot_z", FOOT[2], "Foot z [m]"),
            name="Foot",
        ),
        rrb.Vertical(
            trace("top_x", TOP[0], "T x [m]"), trace("top_z", TOP[2], "T z [m]"), name="T"
        ),
    ]
    if comparison.driven:
        rotor = rrb.Vertical(
            curves(f"{root}/plots/rotor_speed", "Rotor [rad/s]", False),
            curves(f"{root}/plots/rotor_phase", "Phase [deg]", False, (0.0, 360.0)),
            curves(f"{root}/plots/rotor_lag", "Twin lead [deg]", False),
            name="Rotor",
        )
        columns.append(rotor)
    return columns


def _evidence(comparison: Comparison, root: str) -> list[rrb.View | rrb.Container]:
    views: list[rrb.View | rrb.Container] = []
    if len(comparison.real) and len(comparison.twin):
        views.append(_errors(comparison, root))
    views += _missing(comparison, root)
    if comparison.supply is not None:
        volts = [f"{root}/plots/supply/{name}" for name in ("set_voltage_V", "voltage_V")]
        supply = f"{root}/plots/supply"
        amps = [f"{supply}/current_A"]
        views.append(
            rrb.Vertical(
                curves(supply, "Supply [V]", contents=volts),
                curves(supply, "Supply [A]", False, contents=amps),
                name="Supply",
            )
        )
    views.append(_words(comparison, root))
    if journal_lines(comparison):
        hidden = TimelineColumn(TIMELINE, visible=False)
        columns = rrb.TextLogColumns(
            timeline_columns=[hidden], text_log_columns=["loglevel", "body"]
        )
        views.append(rrb.TextLogView(origin=f"{root}/log", name="Journal", columns=columns))
    return views


def _words(comparison: Comparison, root: str) -> rrb.View | rrb.Container:
    """Return the notes and, behind a tab, the protocol as it was given."""
    notes = rrb.TextDocumentView(origin=f"{root}/notes", name="Notes")
    if not comparison.protocol:
        return notes
    asked = rrb.TextDocumentView(origin=f"{root}/protocol", name="Protocol file")
    return rrb.Tabs(notes, asked, active_tab=0, name="Words")


def _errors(comparison: Comparison, root: str) -> rrb.View | rrb.Container:
    """Return the distances to the twin and, on the same axis, to the extended one below."""
    error, extended = comparison.error(), comparison.extended_error()
    name = "{} error [mm]"
    plots = f"{root}/plots"
    if extended is None:
        return curves(f"{plots}/error_mm", name.format("Twin"))
    both = [one.values[one.valid] for one in (error, extended)]
    top = _AIR * max((float(part.max()) for part in both if part.size), default=1.0)
    return rrb.Vertical(
        curves(f"{plots}/error_mm", name.format("Twin"), span=(0.0, top)),
        curves(f"{plots}/extended_error_mm", name.format("Extended"), False, (0.0, top)),
        name="Errors",
    )


def _phases(comparison: Comparison, root: str) -> list[rrb.View]:
    view = rrb.StateTimelineView(origin=f"{root}/phase", name="Protocol")
    return [view] if comparison.phases else []


def curves(
    origin: str,
    name: str,
    legend: bool = True,
    span: tuple[float, float] | None = None,
    contents: Sequence[str] = ("$origin/**",),
    overrides: Overrides | None = None,
) -> rrb.TimeSeriesView:
    """Return a view of curves; without a span the viewer takes its own, which includes zero."""
    return rrb.TimeSeriesView(
        origin=origin,
        contents=contents,
        name=name,
        axis_y=rrb.ScalarAxis(range=span) if span is not None else None,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop, visible=legend),
        overrides=overrides,
    )


def _range(comparison: Comparison, channel: str) -> tuple[float, float] | None:
    """Return the span of all motions with a little air; the viewer's own span includes zero."""
    seen = np.concatenate([m[channel][m.validity(channel)] for m in comparison.motions])
    if len(seen) == 0 or np.ptp(seen) == 0:
        return None
    middle = (float(seen.min()) + float(seen.max())) / 2
    half = max(0.62 * float(np.ptp(seen)), _LEAST_M / 2)
    return middle - half, middle + half
