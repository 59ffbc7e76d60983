"""The layout with which a recording opens."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TimelineColumn

from workbench.motion import FOOT, TOP
from workbench.review import palette
from workbench.review.columns import TIMELINE
from workbench.review.comparison import Comparison
from workbench.review.palette import rgb
from workbench.review.scene import floor_height

__all__ = ["layout"]

_HEIGHT = 0.42  # of the scene: the robot, about 0.35 m, and a little floor
_AIR = 1.05  # of the greatest error, to the end of its axis
_ASPECT = 1.9  # width to height of what a 3-D view shows
_DISTANCE = 1.52  # of the eye from what it looks at, for each metre seen


def layout(comparison: Comparison) -> rrb.Blueprint:
    """Return the views: robots above, curves, error and notes, and the phases below."""
    phases = _phases(comparison)
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*_scenes(comparison)),
            rrb.Horizontal(*_traces(comparison)),
            rrb.Horizontal(*_evidence(comparison)),
            *phases,
            row_shares=[5, 4.2, 3.2, 1.6][: 3 + len(phases)],
        ),
        rrb.TimePanel(timeline=TIMELINE, play_state="paused", state="collapsed"),
        collapse_panels=True,
    )


def _scenes(comparison: Comparison) -> list[rrb.Spatial3DView]:
    """Return each robot alone and all together, all seen by the same eye."""
    eye, floor = _eye(comparison), floor_height(comparison)
    names = {"Real": "real", "Twin": "sim"}
    together = "Real (orange) and twin (blue)"
    if comparison.extended is not None:
        names["Extended twin"] = "extended"
        together = "All three"
    roots = list(names.values())
    # Solid feet in one place would flicker, so those of the twins are outlines here.
    outlined = [f"{root}/foot" for root in roots[1:]]
    return [
        *(_scene(name, [f"/{root}/**"], eye, floor) for name, root in names.items()),
        _scene(together, [f"/{root}/**" for root in roots], eye, floor, outlined),
    ]


def _scene(
    name: str,
    contents: Sequence[str],
    eye: rrb.EyeControls3D,
    floor_z: float,
    outlined: Sequence[str] = (),
) -> rrb.Spatial3DView:
    floor = rr.components.Plane3D(normal=(0, 0, 1), distance=floor_z)
    outline = rr.Boxes3D.from_fields(fill_mode=rr.components.FillMode.MajorWireframe)
    return rrb.Spatial3DView(
        origin="/",
        contents=[*contents, "/floor/**"],
        name=name,
        background=rrb.Background(color=rgb(palette.SHADES["floor"]), kind="SolidColor"),
        line_grid=rrb.LineGrid3D(
            visible=True,
            spacing=0.1,
            plane=floor,
            stroke_width=1.0,
            color=rgb(palette.SHADES["grid"]),
        ),
        eye_controls=eye,
        overrides=dict.fromkeys(outlined, outline),
    )


def _eye(comparison: Comparison) -> rrb.EyeControls3D:
    """Look from the right and a little above, so that forward is to the right of the picture.

    The eye stands still and sees the whole way of all robots: hops are seen against the floor.
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


def _traces(comparison: Comparison) -> list[rrb.Container]:
    def trace(plot: str, channel: str, name: str, legend: bool = False) -> rrb.TimeSeriesView:
        return _curves(plot, name, legend, _range(comparison, channel))

    speed = [rrb.Vertical(_curves("rotor_speed", "Rotor speed [rad/s]"))]
    return [
        rrb.Vertical(
            trace("foot_x", FOOT[0], "Foot forward x [m]", legend=True),
            trace("foot_z", FOOT[2], "Foot height z [m]"),
        ),
        rrb.Vertical(
            trace("top_x", TOP[0], "T forward x [m]"), trace("top_z", TOP[2], "T height z [m]")
        ),
        *(speed if comparison.driven else ()),
    ]


def _evidence(comparison: Comparison) -> list[rrb.View | rrb.Container]:
    views: list[rrb.View | rrb.Container] = [_errors(comparison)]
    if comparison.supply is not None:
        views.append(_curves("supply", "Supply [V, A]"))
    views.append(rrb.TextDocumentView(origin="/notes", name="Notes"))
    if comparison.log or comparison.warnings:
        hidden = TimelineColumn(TIMELINE, visible=False)
        columns = rrb.TextLogColumns(
            timeline_columns=[hidden], text_log_columns=["loglevel", "body"]
        )
        views.append(rrb.TextLogView(origin="/log", name="Journal", columns=columns))
    return views


def _errors(comparison: Comparison) -> rrb.View | rrb.Container:
    """Return the distances to the twin and, on the same axis, to the extended one below."""
    error, extended = comparison.error(), comparison.extended_error()
    name = "Distance from real to {} [mm]"
    if extended is None:
        return _curves("error_mm", name.format("twin"))
    both = [one.values[one.valid] for one in (error, extended)]
    top = _AIR * max((float(part.max()) for part in both if part.size), default=1.0)
    return rrb.Vertical(
        _curves("error_mm", name.format("twin"), span=(0.0, top)),
        _curves("extended_error_mm", name.format("extended twin"), False, (0.0, top)),
    )


def _phases(comparison: Comparison) -> list[rrb.View]:
    view = rrb.StateTimelineView(origin="/phase", name="Protocol")
    return [view] if comparison.phases else []


def _curves(
    plot: str, name: str, legend: bool = True, span: tuple[float, float] | None = None
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=f"/plots/{plot}",
        name=name,
        axis_y=rrb.ScalarAxis(range=span) if span is not None else None,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop, visible=legend),
    )


def _range(comparison: Comparison, channel: str) -> tuple[float, float] | None:
    """Return the span of all motions with a little air; the viewer's own span includes zero."""
    seen = np.concatenate([m[channel][m.validity(channel)] for m in comparison.motions])
    if len(seen) == 0 or np.ptp(seen) == 0:
        return None
    air = 0.12 * np.ptp(seen)
    return float(seen.min() - air), float(seen.max() + air)
