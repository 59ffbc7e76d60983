"""What a shape comes to in a few numbers, and whether it crosses itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Metrics", "clearance", "metrics"]

Points = NDArray[np.float64]
"""Ends of the increments from the root, (N + 1, 2) as x, z [m]; see `curve`."""


class Metrics(NamedTuple):
    """The shape parameters of the thesis (table in section 6.1) and where the tip is.

    The thesis names L0 and dh by a figure only (2.1b) and points to Reis and Iida (2011); it does
    not say between which points they are measured, nor whether on the free strip or the standing
    robot. It does give e = dh / L0. Our reading:

    Args:
        L0_m: straight distance from the beam's root to T.
        dh_m: depth of the bow, the beam's greatest distance from that straight line.
        e: dh / L0.
        tip_x_m: T forward of the root.
        tip_z_m: T above the root.
    """

    L0_m: float
    dh_m: float
    e: float
    tip_x_m: float
    tip_z_m: float


def metrics(points: Points) -> Metrics:
    """Return the numbers of a curve, of the free strip or of the standing robot.

    Args:
        points: (N + 1, 2) x, z [m] from the root to T.
    """
    away = points - points[0]
    chord = away[-1]
    length = float(np.hypot(*chord))
    off = np.abs(chord[0] * away[:, 1] - chord[1] * away[:, 0])
    depth = float(off.max()) / length if length else float(np.hypot(*away.T).max())
    ratio = depth / length if length else float("inf")
    return Metrics(length, depth, ratio, float(chord[0]), float(chord[1]))


def clearance(points: Points) -> float:
    """Return the least distance between two increments that are no neighbours [m]; 0 if they cross.

    Args:
        points: (N + 1, 2) x, z [m].
    """
    starts, ends = points[:-1], points[1:]
    first, second = np.triu_indices(len(starts), k=2)
    a, b, c, d = starts[first], ends[first], starts[second], ends[second]
    if np.any(_cross(a, b, c, d)):
        return 0.0
    # segments that do not cross are nearest at an end of one of them
    gaps = [_to_segment(*each) for each in ((a, c, d), (b, c, d), (c, a, b), (d, a, b))]
    return float(np.min(gaps))


def _cross(a: Points, b: Points, c: Points, d: Points) -> NDArray[np.bool_]:
    """Return which segments a-b and c-d, (n, 2) each, pass through one another."""
    return (_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)


def _side(a: Points, b: Points, point: Points) -> NDArray[np.float64]:
    along, off = b - a, point - a
    return along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]


def _to_segment(point: Points, a: Points, b: Points) -> NDArray[np.float64]:
    """Return the distances of points from segments, all (n, 2)."""
    along = b - a
    share = np.sum((point - a) * along, axis=1) / np.sum(along**2, axis=1)
    nearest = a + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.hypot(*(point - nearest).T)
