"""The beam as a smooth line: straight pieces and arcs, which a strip can be bent along.

The model's beam is a polyline. A strip has no corners: here the bend alpha_k is spread evenly over
half an increment to either side of joint k ("equal-length arcs"). So the line keeps the beam's
length and the direction of every increment at its middle; the first and the last half increment
stay straight, and alpha_0 turns the first increment against the foot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.errors import InputError

__all__ = ["Arcs", "Box", "crossing", "equal_length_arcs"]

Array = NDArray[np.float64]

_STRAIGHT = 1e-12  # [rad] a piece that turns by less is straight
_PARALLEL = 1e-9  # [rad] sides at a smaller angle have no one point in common
_QUARTERS = np.arange(4) * (np.pi / 2)  # [rad] headings along an axis


@dataclass(frozen=True)
class Box:
    """A rectangle along the axes [m].

    Args:
        low: (2,) least x and z [m].
        high: (2,) greatest x and z [m].
    """

    low: Array
    high: Array

    @property
    def size(self) -> Array:
        """Return width and height, (2,) [m]."""
        return self.high - self.low


@dataclass(frozen=True)
class Arcs:
    """A line of M pieces, each straight or an arc, that join without a corner.

    Headings and bends are rotations about +y: heading h points along (cos h, -sin h) in the x-z
    plane, and a positive bend turns forward over the top, clockwise with x to the right.

    Args:
        start: (2,) where it begins, x and z [m].
        heading: at its start [rad].
        lengths: (M,) of the pieces [m].
        bends: (M,) by which each piece turns [rad]; 0 is straight.
    """

    start: Array
    heading: float
    lengths: Array
    bends: Array

    @property
    def length(self) -> float:
        """Return the length of the whole line [m]."""
        return float(self.lengths.sum())

    @property
    def knots(self) -> Array:
        """Return the arc length at which each piece begins, and the end, (M + 1,) [m]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def headings(self) -> Array:
        """Return the heading at each knot, (M + 1,) [rad]."""
        return self.heading + np.concatenate([[0.0], np.cumsum(self.bends)])

    @property
    def knot_points(self) -> Array:
        """Return the points at the knots, (M + 1, 2) as x, z [m]."""
        steps = _chord(self.headings[:-1], self.bends, self.lengths)
        return self.start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def headings_at(self, distance: ArrayLike) -> Array:
        """Return headings, (...,) [rad].

        Args:
            distance: (...,) along the line [m], as for `points_at`.
        """
        piece, along, rate = self._locate(distance)
        return self.headings[piece] + rate * along

    def points_at(self, distance: ArrayLike) -> Array:
        """Return the points at distances along the line, (..., 2) as x, z [m].

        Args:
            distance: (...,) from its start [m]; before the start and beyond the end the first and
                the last piece go on.
        """
        piece, along, rate = self._locate(distance)
        return self.knot_points[piece] + _chord(self.headings[piece], rate * along, along)

    def tangents_at(self, distance: ArrayLike) -> Array:
        """Return the unit vectors along the line, (..., 2) [1].

        Args:
            distance: (...,) along the line [m], as for `points_at`.
        """
        heading = self.headings_at(distance)
        return np.stack([np.cos(heading), -np.sin(heading)], axis=-1)

    def normals_at(self, distance: ArrayLike) -> Array:
        """Return the unit vectors to the left of the line, (..., 2) [1], where `offset` goes.

        On the outer side of a positive bend.

        Args:
            distance: (...,) along the line [m], as for `points_at`.
        """
        heading = self.headings_at(distance)
        return np.stack([np.sin(heading), np.cos(heading)], axis=-1)

    def offset(self, distance: float) -> Arcs:
        """Return the line at a distance to the left; its arcs keep their centres.

        Args:
            distance: [m]; negative is to the right.

        Raises:
            InputError: when an arc has a smaller radius than that, so that it would turn over.
        """
        lengths = self.lengths + distance * self.bends
        if lengths.min() < 0:
            k = int(np.argmin(lengths))
            radius = abs(self.lengths[k] / self.bends[k])
            raise InputError(
                f"a contour {abs(1000 * distance):g} mm from the centreline does not exist: the "
                f"radius there is {1000 * radius:.1f} mm; take a thinner strip or bend less"
            )
        return replace(self, start=self.start + distance * self.normals_at(0.0), lengths=lengths)

    def moved(self, turn: float, shift: ArrayLike = (0.0, 0.0), mirror: bool = False) -> Arcs:
        """Return the line mirrored in x, then turned about the origin, then shifted.

        Args:
            turn: counter-clockwise with x to the right and z up [rad].
            shift: (2,) [m].
            mirror: x becomes -x.
        """
        start, heading, bends = self.start, self.heading, self.bends
        if mirror:
            start, heading, bends = start * [-1.0, 1.0], np.pi - heading, -bends
        cosine, sine = np.cos(turn), np.sin(turn)
        start = np.array([[cosine, -sine], [sine, cosine]]) @ start + np.asarray(shift)
        return replace(self, start=start, heading=float(heading - turn), bends=bends)

    def scaled(self, factor: float) -> Arcs:
        """Return the line in another unit of length."""
        return replace(self, start=factor * self.start, lengths=factor * self.lengths)

    def box(self) -> Box:
        """Return the smallest rectangle along the axes that holds the line."""
        ends = self.knot_points
        points = [ends]
        headings, knots = self.headings, self.knots
        for k in np.flatnonzero(np.abs(self.bends) > _STRAIGHT):
            turned = (_QUARTERS[:, None] - headings[k]) % (2 * np.pi) - [0.0, 2 * np.pi]
            share = turned / self.bends[k]  # of the piece, where it runs along an axis
            inside = share[(share > 0) & (share < 1)]
            points.append(self.points_at(knots[k] + inside * self.lengths[k]))
        every = np.concatenate(points)
        return Box(every.min(axis=0), every.max(axis=0))

    def _locate(self, distance: ArrayLike) -> tuple[NDArray[np.intp], Array, Array]:
        """Return piece, distance within it and its curvature [1/m]."""
        asked = np.asarray(distance, dtype=float)
        knots = self.knots
        piece = np.clip(np.searchsorted(knots, asked, "right") - 1, 0, len(self.lengths) - 1)
        lengths = np.where(self.lengths > 0, self.lengths, 1.0)
        return piece, asked - knots[piece], (self.bends / lengths)[piece]


def equal_length_arcs(angles: ArrayLike, length: float) -> Arcs:
    """Return the beam's centreline from its root at the origin.

    The pieces are a straight half increment, an arc of one increment's length for each joint after
    the root's, and a straight half increment. Joint k lies at k increments along the line, in the
    middle of its arc.

    Args:
        angles: (N,) alpha_0 to alpha_{N-1} [rad].
        length: of the whole beam [m].
    """
    alpha = np.asarray(angles, dtype=float)
    lengths = np.full(len(alpha) + 1, length / len(alpha))
    lengths[[0, -1]] /= 2
    bends = np.concatenate([[0.0], alpha[1:], [0.0]])
    return Arcs(np.zeros(2), float(alpha[0]), lengths, bends)


def crossing(points: ArrayLike) -> tuple[int, int] | None:
    """Return two sides of a polygon that cross each other, or None.

    Args:
        points: (n, 2) its corners [m]; the last side leads back to the first corner.
    """
    corner = np.asarray(points, dtype=float)
    side = np.roll(corner, -1, axis=0) - corner
    between = corner[None] - corner[:, None]  # from the start of side i to that of side j
    across = _cross(side[:, None], side[None])
    long = np.linalg.norm(side, axis=1)
    across[np.abs(across) <= _PARALLEL * long[:, None] * long] = np.nan
    along_i = _cross(between, side[None]) / across
    along_j = _cross(between, side[:, None]) / across
    hit = (along_i >= 0) & (along_i <= 1) & (along_j >= 0) & (along_j <= 1)
    n = len(corner)
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    hit &= (apart > 1) & (apart < n - 1)  # neighbours share a corner
    found = np.argwhere(hit)
    return None if not len(found) else (int(found[0, 0]), int(found[0, 1]))


def _chord(heading: Array, bend: Array, length: Array) -> Array:
    """Return the vectors from start to end of pieces, (..., 2)."""
    reach = length * np.sinc(bend / (2 * np.pi))
    middle = heading + bend / 2
    return np.stack([reach * np.cos(middle), -reach * np.sin(middle)], axis=-1)


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
