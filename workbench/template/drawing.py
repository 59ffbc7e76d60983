"""Draw a strip: centreline, contours, polyline, stations, foot and T, in one drawing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.shape import Arcs, curve
from workbench.template.figure import Drawing, Layer, Path, circle, follow, line
from workbench.template.labels import LabelRequest, place_labels
from workbench.template.strip import Strip

__all__ = ["TICK_MM", "Placement", "draw_lines", "draw_strip"]

Array = NDArray[np.float64]

TICK_MM = 2.5
"""How far a station's tick reaches beyond the contours."""

_FOOT_MM = 30.0  # of the foot's line to either side of the root
_HATCH_MM = 3.0
_ARROW_MM = 4.0
_DIAL_MM = 12.0  # radius of the arc that shows alpha_0
_TIP_MM = 3.0
_STRAIGHT_DEG = 0.05  # a smaller bend is written as straight


@dataclass(frozen=True)
class Placement:
    """How the strip lies on the paper.

    Args:
        turn: counter-clockwise [rad].
        mirror: whether it is seen from the left of the robot, its forward direction to the left.
    """

    turn: float = 0.0
    mirror: bool = False

    def course(self, centreline: Arcs) -> Arcs:
        """Return the centreline as it lies there [mm], of one in metres."""
        return centreline.scaled(1000.0).moved(self.turn, mirror=self.mirror)

    def points(self, points: ArrayLike) -> Array:
        """Return points of the x-z plane as they lie there, (n, 2) [mm].

        Args:
            points: (n, 2) x and z [mm].
        """
        flipped = np.asarray(points, dtype=float) * [-1.0 if self.mirror else 1.0, 1.0]
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        return flipped @ np.array([[cosine, sine], [-sine, cosine]])


def draw_strip(strip: Strip, placement: Placement | None = None) -> Drawing:
    """Return the drawing, the beam's root at the origin.

    Args:
        strip: the free strip.
        placement: by default upright and seen from the right, forward to the right.
    """
    bare = draw_lines(strip, placement or Placement())
    wanted = _wanted(strip, placement or Placement())
    return replace(bare, labels=place_labels(wanted, bare.samples()))


def draw_lines(strip: Strip, placement: Placement) -> Drawing:
    """Return the drawing without its labels; arguments as for `draw_strip`."""
    course = placement.course(strip.centreline)
    corners = placement.points(1000 * curve(strip.angles, strip.length))
    return Drawing(
        (
            _outline(course, 1000 * strip.thickness),
            follow(Layer.CENTRELINE, course),
            line(Layer.POLYLINE, corners),
            *_ticks(course, strip),
            *_foot(strip, placement),
            *_tip(course),
        )
    )


def _outline(course: Arcs, thickness: float) -> Path:
    """Return both contours and the ends as one closed path."""
    outer = follow(Layer.CONTOUR, course.offset(thickness / 2))
    inner = follow(Layer.CONTOUR, course.offset(-thickness / 2))
    back = -inner.bulges[:-1][::-1]
    return Path(
        Layer.CONTOUR,
        np.concatenate([outer.points, inner.points[::-1]]),
        np.concatenate([outer.bulges, back, [0.0]]),
        closed=True,
    )


def _stations(course: Arcs, strip: Strip) -> Array:
    """Return where the joints are along the centreline, (N,) [mm]."""
    count = len(strip.angles)
    return np.arange(count) * course.length / count


def _ticks(course: Arcs, strip: Strip) -> list[Path]:
    at = _stations(course, strip)
    reach = 1000 * strip.thickness / 2 + TICK_MM
    across = reach * course.normals_at(at)
    middle = course.points_at(at)
    return [
        line(Layer.STATIONS, ends) for ends in np.stack([middle - across, middle + across], axis=1)
    ]


def _foot(strip: Strip, placement: Placement) -> list[Path]:
    """Return the foot's line with hatching below, an arrow forward, and the dial of alpha_0."""
    long, short = _FOOT_MM, _HATCH_MM
    marks = np.arange(-long, long, 2 * short)
    shapes = [[(-long, 0), (long, 0)]]
    shapes += [[(x + short, 0), (x, -short)] for x in marks]
    shapes += [[(long - _ARROW_MM, 1.5), (long, 0), (long - _ARROW_MM, -1.5)]]
    paths = [line(Layer.FOOT, placement.points(points)) for points in shapes]
    bulge = np.tan(-strip.angles[0] / 4) * (-1 if placement.mirror else 1)
    tip = (_DIAL_MM * np.cos(strip.angles[0]), -_DIAL_MM * np.sin(strip.angles[0]))
    dial = placement.points([(_DIAL_MM, 0), tip])
    return [*paths, Path(Layer.FOOT, dial, np.array([bulge, 0.0]))]


def _tip(course: Arcs) -> list[Path]:
    end = course.knot_points[-1]
    arms = 1.6 * _TIP_MM * np.eye(2)
    return [
        circle(Layer.TIP, end, _TIP_MM),
        *(line(Layer.TIP, [end - arm, end + arm]) for arm in arms),
    ]


def _wanted(strip: Strip, placement: Placement) -> list[LabelRequest]:
    """Return the texts with the places that they belong to."""
    course = placement.course(strip.centreline)
    at = _stations(course, strip)
    middle, normal = course.points_at(at), course.normals_at(at)
    clear = 1000 * strip.thickness / 2 + TICK_MM
    bends = -course.bends[1:-1]  # counter-clockwise, as they lie on the paper
    inner = np.where(bends >= 0, 1.0, -1.0)[:, None] * normal[1:]
    texts = [_bend_text(k, strip) for k in range(len(strip.angles))]
    wanted = [
        LabelRequest(Layer.STATIONS, text, point, towards, clear)
        for text, point, towards in zip(texts[1:], middle[1:], inner, strict=True)
    ]
    half = strip.angles[0] / 2  # the label of alpha_0 is on the middle of its dial
    between = (np.cos(half), -np.sin(half))
    ahead, forward, outward = placement.points([(_FOOT_MM, 0), (1, 0), between])
    tip = course.tangents_at(course.length)
    return [
        *wanted,
        LabelRequest(Layer.STATIONS, texts[0], middle[0], outward, _DIAL_MM),
        LabelRequest(Layer.FOOT, "foot, forward", ahead, forward, 0.0),
        LabelRequest(Layer.TIP, "T", course.knot_points[-1], tip, 1.6 * _TIP_MM),
    ]


def _bend_text(k: int, strip: Strip) -> str:
    degrees = np.degrees(strip.angles[k])
    if k == 0:
        return f"0  root  {degrees:+.1f}°"
    if abs(degrees) < _STRAIGHT_DEG:
        return f"{k}  straight"
    radius = 1000 * strip.length / len(strip.angles) / abs(strip.angles[k])
    return f"{k}  {degrees:+.1f}°  R {radius:.0f} mm"
