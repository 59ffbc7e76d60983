"""Refine the strip's contour to a fraction of a pixel, where the strip's side cannot mislead.

The camera sees the strip's upper edge and, towards the point below the camera, some of its side.
So only the contour away from that point is sought, from outside in; half the thickness between it
and the centreline is fitted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.photo.fit import Points
from workbench.photo.strip import View
from workbench.shape import Arcs

__all__ = ["refined_points"]

Array = NDArray[np.float64]

_STATION_M = 0.0005
_STEP_M = 0.00005
_REACH_M = 0.005  # beyond the contour
_HALF = 0.5  # of the way from field to strip, where the contour lies
_END_NOISE_M = 0.0003
_WIDEST_BLUR = 1.2  # thicknesses, from a tenth to nine tenths of the way up
_MOST_GAPS = 0.3


def refined_points(
    view: View, arcs: Arcs, thickness: tuple[float, float], width: float
) -> Points:
    """Return points of the contour that faces away from the camera's foot, and both ends.

    Args:
        view: of the photograph.
        arcs: the centreline as known so far.
        thickness: of the strip as it appears, and its standard deviation [m].
        width: of the strip, by which its upper edge stands above the board [m].

    Raises:
        InputError: when the contour is blurred or mostly not seen.
    """
    along = np.arange(_STATION_M, arcs.length - _STATION_M, _STATION_M)
    middle, normal = arcs.points_at(along), arcs.normals_at(along)
    outward = np.sum((middle - view.below()[0]) * normal, axis=1)
    side = np.where(outward >= 0, 1.0, -1.0)
    found, rise = _contour(view, middle, side[:, None] * normal, thickness[0])
    seen = np.isfinite(found)
    if seen.mean() < 1 - _MOST_GAPS:
        raise InputError(
            f"{view.name}: {1 - seen.mean():.0%} of the strip's contour cannot be seen; light it "
            "evenly from above, or put a coloured tape on its edge (--tape)"
        )
    if np.median(rise[seen]) > _WIDEST_BLUR * thickness[0]:
        raise InputError(
            f"{view.name}: blurred, the strip's edge spreads over {1000 * np.median(rise[seen]):.1f}"
            " mm; hold the camera still and focus on the strip"
        )
    places = middle + (side * found)[:, None] * normal
    ends, noise = _ends(view, arcs, thickness[0], width)
    half = thickness[0] / 2, thickness[1] / 2
    return Points(places[seen], side[seen], ends, noise, half)


def _contour(view: View, middle: Array, out: Array, thickness: float) -> tuple[Array, Array]:
    """Return how far out the contour lies from each middle, and how wide its rise is, (n,) [m]."""
    offsets = np.arange(thickness + _REACH_M, -thickness - _REACH_M, -_STEP_M)
    strength = view.at(middle[:, None] + offsets[:, None] * out[:, None]).astype(float)
    ground = np.median(strength[:, offsets > thickness], axis=1)
    above = strength - ground[:, None]
    first = _crossing(above, _HALF * above.max(axis=1))
    inside = first + round(0.5 * thickness / _STEP_M)
    top = np.take_along_axis(above, np.clip(inside, 0, len(offsets) - 1)[:, None], 1)[:, 0]
    usual = float(np.median(top))
    place = _between(above, offsets, _HALF * top)
    rise = _between(above, offsets, 0.1 * top) - _between(above, offsets, 0.9 * top)
    dim = top < 0.2 * usual
    return np.where(dim, np.nan, place), rise


def _crossing(above: Array, level: Array) -> NDArray[np.intp]:
    """Return where each row first exceeds its level, (n,)."""
    return np.argmax(above >= level[:, None], axis=1)


def _between(above: Array, offsets: Array, level: Array) -> Array:
    """Return the offset where each row first reaches its level, between two samples, (n,)."""
    k = np.maximum(_crossing(above, level), 1)
    rows = np.arange(len(above))
    low, high = above[rows, k - 1], above[rows, k]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip((level - low) / (high - low), 0, 1)
    place = offsets[k - 1] + share * (offsets[k] - offsets[k - 1])
    return np.where(above.max(axis=1) >= level, place, np.nan)


def _ends(view: View, arcs: Arcs, thickness: float, width: float) -> tuple[Array, Array]:
    """Return root and tip, (2, 2) [m], and how sure they are along the strip, (2,) [m].

    An end that faces the point below the camera shows its end face, which makes it uncertain by
    as much as that face is long in the picture.
    """
    at = np.array([0.0, arcs.length])
    out = arcs.tangents_at(at) * np.array([[-1.0], [1.0]])
    ends = arcs.points_at(at)
    across = np.linspace(-0.25, 0.25, 5)[:, None] * thickness
    found = np.array([
        np.nanmedian(_contour(view, end + across * normal, np.tile(way, (5, 1)), 0.004)[0])
        for end, way, normal in zip(ends, out, arcs.normals_at(at), strict=True)
    ])  # fmt: skip
    below, height = view.below()
    facing = -np.sum((ends - below) * out, axis=1) * width / height
    noise = np.hypot(_END_NOISE_M, np.maximum(facing, 0.0))
    lost = ~np.isfinite(found)
    return ends + np.where(lost, 0.0, found)[:, None] * out, np.where(lost, 0.01, noise)
