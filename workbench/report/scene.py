"""The robots and the floor in 3-D, as entities of a recording."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from workbench.motion import FOOT, ROTOR, TOP, position
from workbench.report import palette
from workbench.report.columns import TIMELINE, send_seen
from workbench.report.comparison import Comparison, Figure
from workbench.report.geometry import (
    MISSING,
    beam_points,
    beam_root,
    certainty,
    foot_pitch,
    ground_forces,
    missing_force,
    missing_scale,
    pitch_quaternions,
)
from workbench.report.palette import rgb
from workbench.timeseries import TimeSeries

__all__ = ["FORCE_M_PER_N", "draw_floor", "draw_real", "draw_simulated", "floor_height"]

_FOOT_THICKNESS = 0.008
_POINT_RADIUS = 0.008
_LINE_RADIUS = 0.003
_THIN_RADIUS = 0.0008
_AROUND_M, _LANE_M, _GROUND_M = 0.4, 0.38, 0.002  # of the ground: before and behind, wide, thick
FORCE_M_PER_N = 0.05  # length of an arrow: a corner carries 0.6 N at rest, a few while it hops


def floor_height(comparison: Comparison) -> float:
    """Return the height of the drawn floor [m]: half a foot's thickness below its centre."""
    return comparison.floor_m - _FOOT_THICKNESS / 2


def draw_floor(stream: rr.RecordingStream, comparison: Comparison, root: str = "") -> None:
    """Draw the ground and a scale along it, a tick every 0.1 m; the grid belongs to the views."""
    z = floor_height(comparison)
    y = -0.5 * comparison.figure.foot_width - 0.04
    last = max(3, int(np.ceil(10 * comparison.reach()[1])))
    rail = [[0, y, z], [last / 10, y, z]]
    ticks = [[[k / 10, y, z], [k / 10, y - 0.02, z]] for k in range(last + 1)]
    named = [k for k in range(last + 1) if k % 5 == 0 or k == last]
    lines = rr.LineStrips3D([rail, *ticks], radii=_THIN_RADIUS, colors=rgb(palette.SHADES["scale"]))
    marks = rr.Points3D(
        [[k / 10, y - 0.02, z] for k in named],
        labels=[f"{k / 10:g} m" for k in named],
        radii=0.0001,
        colors=rgb(palette.SHADES["marks"]),
    )
    start, end = comparison.reach()
    half = [(end - start) / 2 + _AROUND_M, _LANE_M / 2, _GROUND_M / 2]
    ground = rr.Boxes3D(
        centers=[(start + end) / 2, 0.0, z - 1.5 * _GROUND_M],
        half_sizes=half,
        colors=rgb(palette.SHADES["ground"]),
        fill_mode=rr.components.FillMode.Solid,
    )
    stream.log(f"{root}floor/ground", ground, static=True)
    stream.log(f"{root}floor/scale", lines, static=True)
    stream.log(f"{root}floor/marks", marks, static=True)


def draw_real(
    stream: rr.RecordingStream,
    path: str,
    real: TimeSeries,
    figure: Figure,
    estimate: TimeSeries | None = None,
) -> None:
    """Draw what the cameras saw; between root and T the beam as estimated, else a thin line."""
    _draw_parts(stream, path, real, figure, palette.REAL)
    if estimate is not None:
        _draw_estimate(stream, f"{path}/beam", estimate, figure)
        return
    link = np.stack([beam_root(real, figure), position(real, TOP)], axis=1)
    _send_strips(stream, f"{path}/link", real.times, link)
    stream.log(
        f"{path}/link",
        rr.LineStrips3D.from_fields(radii=_THIN_RADIUS, colors=rgb(palette.REAL)),
        rr.AnyValues(note="the beam between foot and T was not measured"),
        static=True,
    )


def _draw_estimate(
    stream: rr.RecordingStream, path: str, estimate: TimeSeries, figure: Figure
) -> None:
    """Send each increment of the beam, its colour the fainter the less certain its place is."""
    points, sure = beam_points(estimate, figure), certainty(estimate)
    pieces = np.stack([points[:, :-1], points[:, 1:]], axis=2).astype(np.float32)
    seen = _seen(points)
    far, ink = np.array(rgb(palette.SHADES["ground"])), np.array(rgb(palette.REAL))
    colors = (far + sure[seen][..., None] * (ink - far)).round().astype(np.uint8)
    beams = rr.LineStrips3D.columns(
        strips=pieces[seen].reshape(-1, 2, 3), colors=colors.reshape(-1, 3)
    )
    send_seen(stream, path, estimate.times, seen, beams, each=sure.shape[1])
    stream.log(
        path,
        rr.LineStrips3D.from_fields(radii=_LINE_RADIUS),
        rr.AnyValues(note="the beam was estimated, not measured; fainter where less certain"),
        static=True,
    )
    _draw_missing(stream, path.rpartition("/")[0], estimate)


def _draw_missing(stream: rr.RecordingStream, root: str, estimate: TimeSeries) -> None:
    """Draw the force missing at T, and at a free foot, where it is more than noise."""
    reach = missing_scale(estimate)
    for point, columns in (("top", TOP), ("foot", FOOT)):
        if MISSING[point][0] not in estimate:
            continue
        force, sure = missing_force(estimate, point)
        origins = position(estimate, columns)
        seen = sure & _seen(origins)
        arrows = rr.Arrows3D.columns(origins=origins[seen], vectors=reach * force[seen])
        path = f"{root}/missing/{point}"
        send_seen(stream, path, estimate.times, seen, arrows)
        look = rr.Arrows3D.from_fields(radii=_LINE_RADIUS, colors=rgb(palette.SHADES["missing"]))
        stream.log(path, look, rr.AnyValues(metres_per_newton=reach), static=True)


def draw_simulated(
    stream: rr.RecordingStream, path: str, motion: TimeSeries, figure: Figure, color: str
) -> None:
    """Draw a simulated robot with its whole beam, a chain of straight increments.

    The ground's force on each corner of its foot is an arrow, 50 mm for each newton.

    Raises:
        ValueError: when the motion carries no hinge angles.
    """
    _draw_parts(stream, path, motion, figure, color)
    _send_strips(stream, f"{path}/beam", motion.times, beam_points(motion, figure))
    stream.log(
        f"{path}/beam",
        rr.LineStrips3D.from_fields(radii=_LINE_RADIUS, colors=rgb(color)),
        static=True,
    )
    _draw_forces(stream, f"{path}/ground", motion, figure)


def _draw_forces(stream: rr.RecordingStream, path: str, motion: TimeSeries, figure: Figure) -> None:
    """Draw the ground's forces on the corners, nothing while the foot is in the air."""
    pushed = ground_forces(motion, figure)
    if pushed is None:
        return
    points, forces = pushed
    seen = (forces != 0).any(axis=(1, 2)) & _seen(points)
    arrows = rr.Arrows3D.columns(
        origins=points[seen].reshape(-1, 3), vectors=FORCE_M_PER_N * forces[seen].reshape(-1, 3)
    )
    send_seen(stream, path, motion.times, seen, arrows, each=points.shape[1])
    look = rr.Arrows3D.from_fields(radii=_LINE_RADIUS, colors=rgb(palette.SHADES["force"]))
    stream.log(path, look, rr.AnyValues(metres_per_newton=FORCE_M_PER_N), static=True)


def _draw_parts(
    stream: rr.RecordingStream, root: str, motion: TimeSeries, figure: Figure, color: str
) -> None:
    """Draw the foot, T, the rotor and the arm between them under `root`."""
    top, rotor = position(motion, TOP), position(motion, ROTOR)
    _send_foot(stream, f"{root}/foot", motion, figure)
    _send_points(stream, f"{root}/top", motion.times, top)
    _send_points(stream, f"{root}/rotor", motion.times, rotor)
    _send_strips(stream, f"{root}/arm", motion.times, np.stack([top, rotor], axis=1))
    solid = rr.components.FillMode.Solid
    style = {
        "foot": rr.Boxes3D.from_fields(colors=rgb(color), fill_mode=solid),
        "top": rr.Points3D.from_fields(colors=rgb(color), radii=_POINT_RADIUS),
        "rotor": rr.Points3D.from_fields(colors=rgb(color), radii=1.3 * _POINT_RADIUS),
        "arm": rr.LineStrips3D.from_fields(colors=rgb(color), radii=_LINE_RADIUS),
    }
    for part, look in style.items():
        stream.log(f"{root}/{part}", look, static=True)


def _send_foot(stream: rr.RecordingStream, path: str, motion: TimeSeries, figure: Figure) -> None:
    """Send the pose where seen and the box's size at every row, empty where not seen."""
    centre = position(motion, FOOT)
    seen = _seen(centre)
    size = [figure.foot_length / 2, figure.foot_width / 2, _FOOT_THICKNESS / 2]
    if seen.any():
        stream.send_columns(
            path,
            [rr.TimeColumn(TIMELINE, duration=motion.times[seen])],
            rr.Transform3D.columns(
                translation=centre[seen], quaternion=pitch_quaternions(foot_pitch(motion)[seen])
            ),
        )
    boxes = rr.Boxes3D.columns(half_sizes=np.tile(size, (len(centre[seen]), 1)))
    send_seen(stream, path, motion.times, seen, boxes)


def _send_points(
    stream: rr.RecordingStream, path: str, times: NDArray[np.float64], points: NDArray[np.float64]
) -> None:
    seen = _seen(points)
    send_seen(stream, path, times, seen, rr.Points3D.columns(positions=points[seen]))


def _send_strips(
    stream: rr.RecordingStream, path: str, times: NDArray[np.float64], strips: NDArray[np.float64]
) -> None:
    """Send one strip a row; `strips` is (n, points, 3) [m]."""
    seen = _seen(strips)
    send_seen(
        stream, path, times, seen, rr.LineStrips3D.columns(strips=strips[seen].astype(np.float32))
    )


def _seen(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(points).all(axis=tuple(range(1, points.ndim))))
