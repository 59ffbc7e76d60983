"""The drawing that all three writers draw: paths of straight pieces and arcs, and labels, in mm."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.shape import Arcs

__all__ = ["Anchor", "Arc", "Drawing", "Label", "Layer", "Path", "arc", "circle", "follow", "line"]

Array = NDArray[np.float64]
Anchor = Literal["start", "middle", "end"]

CHARACTER = 0.62  # width of a character over the height of its font, on the wide side
_STRAIGHT = 1e-9  # a piece with a smaller bulge is straight
_SAMPLE_MM = 1.0  # between the points that sample a path


class Layer(StrEnum):
    """What a path or a label belongs to; the names are those of the layers in SVG and DXF."""

    CONTOUR = "contour"
    CENTRELINE = "centreline"
    POLYLINE = "polyline"
    STATIONS = "stations"
    FOOT = "foot"
    TIP = "tip"


class Arc(NamedTuple):
    """A piece of a circle; angles counter-clockwise from +x.

    Args:
        centre: (2,) [mm].
        radius: [mm].
        begin: [rad].
        sweep: [rad], positive counter-clockwise.
    """

    centre: Array
    radius: float
    begin: float
    sweep: float


def arc(start: Array, end: Array, bulge: float) -> Arc | None:
    """Return the arc from one point to another, or None where the bulge makes it straight.

    Args:
        start: (2,) [mm].
        end: (2,) [mm].
        bulge: tangent of a quarter of the sweep, as in DXF; positive turns counter-clockwise.
    """
    if abs(bulge) < _STRAIGHT:
        return None
    chord = end - start
    half = float(np.linalg.norm(chord)) / 2
    sweep = 4 * np.arctan(bulge)
    left = np.array([-chord[1], chord[0]]) / (2 * half)
    centre = (start + end) / 2 + left * half / np.tan(sweep / 2)
    spoke = start - centre
    return Arc(
        centre, abs(half / np.sin(sweep / 2)), float(np.arctan2(spoke[1], spoke[0])), float(sweep)
    )


@dataclass(frozen=True)
class Path:
    """Corners joined by straight pieces and arcs.

    Args:
        layer: what it belongs to.
        points: (n, 2) corners, x to the right and y up [mm].
        bulges: (n,) of the piece that begins at each corner [1]; the last one only where closed.
        closed: whether a piece leads from the last corner to the first.
    """

    layer: Layer
    points: Array
    bulges: Array
    closed: bool = False

    @property
    def pieces(self) -> list[tuple[Array, Array, float]]:
        """Return start, end, (2,) [mm] each, and bulge of every piece."""
        ends = np.roll(self.points, -1, axis=0)
        count = len(self.points) - (not self.closed)
        return [(self.points[i], ends[i], float(self.bulges[i])) for i in range(count)]

    @property
    def length(self) -> float:
        """Return the length along the path [mm]."""
        total = 0.0
        for start, end, bulge in self.pieces:
            found = arc(start, end, bulge)
            straight = float(np.linalg.norm(end - start))
            total += straight if found is None else found.radius * abs(found.sweep)
        return total

    def samples(self) -> Array:
        """Return points on the path at most 1 mm apart, (m, 2) [mm]."""
        return np.concatenate([self.points, *(_sampled(*piece) for piece in self.pieces)])


@dataclass(frozen=True)
class Label:
    """A text that is upright on the paper.

    Args:
        layer: what it belongs to.
        text: one line.
        at: (2,) where its baseline begins, has its middle or ends [mm].
        anchor: which of these.
        height: of the font [mm].
    """

    layer: Layer
    text: str
    at: Array
    anchor: Anchor = "start"
    height: float = 2.5

    @property
    def corners(self) -> Array:
        """Return lower left and upper right corner, (2, 2) [mm]."""
        width = CHARACTER * self.height * len(self.text)
        left = self.at[0] - width * {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor]
        low = self.at[1] - 0.25 * self.height
        return np.array([[left, low], [left + width, low + 1.1 * self.height]])


@dataclass(frozen=True)
class Drawing:
    """Paths and labels, x to the right and y up [mm]."""

    paths: tuple[Path, ...]
    labels: tuple[Label, ...] = ()

    def layer(self, layer: Layer) -> tuple[Path, ...]:
        """Return the paths of a layer."""
        return tuple(path for path in self.paths if path.layer is layer)

    def samples(self) -> Array:
        """Return points that sample all that must be on the paper, (n, 2) [mm]."""
        return np.concatenate(
            [path.samples() for path in self.paths] + [label.corners for label in self.labels]
        )


def follow(layer: Layer, course: Arcs) -> Path:
    """Return a line of arcs as a path [mm]."""
    return Path(layer, course.knot_points, np.append(np.tan(-course.bends / 4), 0.0))


def line(layer: Layer, points: ArrayLike) -> Path:
    """Return straight pieces between points.

    Args:
        layer: what it belongs to.
        points: (n, 2) [mm].
    """
    corners = np.asarray(points, dtype=float)
    return Path(layer, corners, np.zeros(len(corners)))


def circle(layer: Layer, centre: Array, radius: float) -> Path:
    """Return a circle.

    Args:
        layer: what it belongs to.
        centre: (2,) [mm].
        radius: [mm].
    """
    side = np.array([radius, 0.0])
    return Path(layer, np.array([centre - side, centre + side]), np.ones(2), closed=True)


def _sampled(start: Array, end: Array, bulge: float) -> Array:
    found = arc(start, end, bulge)
    length = float(np.linalg.norm(end - start))
    if found is not None:
        length = found.radius * abs(found.sweep)
    share = np.linspace(0, 1, max(2, int(np.ceil(length / _SAMPLE_MM)) + 1))[:, None]
    if found is None:
        return start + share * (end - start)
    angle = found.begin + share[:, 0] * found.sweep
    return found.centre + found.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
