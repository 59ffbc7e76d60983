"""Refine the strip's contour to a fraction of a pixel, where the strip's side cannot mislead.

The camera sees the strip's upper edge and, towards the point below the camera, some of its side.
So only the contour away from that point is sought, from outside in; half the thickness between it
and the centreline is fitted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.photo.fit import StripPoints
from workbench.photo.strip import StripView
from workbench.shape import Arcs

__all__ = ["refined_points"]

Array = NDArray[np.float64]

_STATION_M = 0.0005
_STEP_M = 0.00005
_REACH_M = 0.0025  # beyond a thickness from the middle: markers may lie close to the strip
_HALF = 0.5  # of the way from field to strip, where the contour lies
_END_REACH_M = 0.007  # either way, in which an end is sought
_AROUND_M = 0.2  # along the strip, over which its light is compared
_USUAL = 30  # percentile of it
_FLANK = 0.3, 0.6  # of the usual light: two levels below saturation
_GLARE_DOUBT = 5.0
_GLARE = 1.4  # of the usual light
_DIM = 0.2
_SATURATED = 0.97  # of what the sensor can measure
_BELOW_SATURATED = 0.9
_HALO_M = 0.003  # along the strip, around glare
_END_NOISE_M = 0.0003
_WIDEST_BLUR = 0.5  # thicknesses, standard deviation
_MOST_GAPS = 0.5


class _Contour(NamedTuple):
    """A contour as seen.

    Args:
        offset: (n,) how far out it lies [m]; NaN where it is not seen.
        blur: (n,) standard deviation of its rise [m].
        doubt: (n,) how much less sure than usual it is.
    """

    offset: Array
    blur: Array
    doubt: Array


def refined_points(
    view: StripView, arcs: Arcs, thickness: tuple[float, float], width: float
) -> StripPoints:
    """Return points of the contour that faces away from the camera's foot, and both ends.

    Args:
        view: of the photograph.
        arcs: the centreline as known so far.
        thickness: of the strip as it appears, and its standard deviation [m].
        width: of the strip, by which its upper edge is above the board [m].

    Raises:
        InputError: when the contour is blurred or mostly not seen.
    """
    along = np.arange(_STATION_M, arcs.length - _STATION_M, _STATION_M)
    middle, normal = arcs.points_at(along), arcs.normals_at(along)
    outward = np.sum((middle - view.below()[0]) * normal, axis=1)
    side = np.where(outward >= 0, 1.0, -1.0)
    found = _contour(view, middle, side[:, None] * normal, thickness[0])
    seen = np.isfinite(found.offset)
    if seen.mean() < 1 - _MOST_GAPS:
        raise InputError(
            f"{view.name}: {1 - seen.mean():.0%} of the strip's contour cannot be seen; light it "
            "evenly from above, or put a coloured tape on its edge (--tape)"
        )
    blur = float(np.nanmedian(found.blur))
    if not blur < _WIDEST_BLUR * thickness[0]:
        raise InputError(
            f"{view.name}: blurred, the strip's edge spreads by {1000 * blur:.1f} mm; hold the "
            "camera still and focus on the strip"
        )
    positions = middle + (side * found.offset)[:, None] * normal
    ends, noise = _ends(view, arcs, thickness[0], width)
    half = thickness[0] / 2, thickness[1] / 2
    return StripPoints(positions[seen], side[seen], ends, noise, half, found.doubt[seen])


def _contour(view: StripView, middle: Array, out: Array, thickness: float) -> _Contour:
    """Return the contour from middles (n, 2) along unit vectors (n, 2)."""
    offsets = np.arange(thickness + _REACH_M, -thickness - _REACH_M, -_STEP_M)
    strength = view.at(middle[:, None] + offsets[:, None] * out[:, None]).astype(float)
    ground = np.median(strength[:, offsets > thickness], axis=1)
    above = strength - ground[:, None]
    first = _crossing(above, _HALF * above.max(axis=1))
    inside = first + round(0.5 * thickness / _STEP_M)
    top = np.take_along_axis(above, np.clip(inside, 0, len(offsets) - 1)[:, None], 1)[:, 0]
    usual = scipy.ndimage.percentile_filter(
        top, _USUAL, size=round(_AROUND_M / _STATION_M), mode="nearest"
    )
    spots = (top > _GLARE * usual) | ((top > _SATURATED) & (usual < _BELOW_SATURATED))
    halo = round(_HALO_M / _STATION_M)
    glaring = np.asarray(scipy.ndimage.binary_dilation(spots, iterations=halo), dtype=bool)
    position = _between(above, offsets, _HALF * top)
    low, high = (_between(above, offsets, share * usual) for share in _FLANK)
    rise = (low - high) / _flank(1.0)[0]
    if glaring.any() and not glaring.all():
        position[glaring] = _below_glare(low, high, float(np.nanmedian(rise[~glaring])))[glaring]
    position[top < _DIM * usual] = np.nan
    return _Contour(position, rise, np.where(glaring, _GLARE_DOUBT, 1.0))


def _below_glare(low: Array, high: Array, blur: float) -> Array:
    """Return the contour where light overflows: half of it then lies outside the contour.

    The flank of a step of height h, blurred by a normal distribution, is known where it passes two
    levels below saturation; the steeper it is, the higher the step.

    Args:
        low: (n,) where it passes the lower level [m].
        high: (n,) where it passes the higher [m].
        blur: standard deviation where nothing glares [m].
    """
    heights = np.geomspace(30.0, 1.0, 200)
    widths, offsets = np.array([_flank(h) for h in heights]).T
    height = np.interp((low - high) / blur, widths, heights)
    return low - blur * np.interp(-height, -heights, offsets)


def _flank(height: float) -> tuple[float, float]:
    """Return a blurred step's way between both levels and the lower's from the step [blurs]."""
    low, high = (float(scipy.special.ndtri(1 - share / height)) for share in _FLANK)
    return low - high, low


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
    position = offsets[k - 1] + share * (offsets[k] - offsets[k - 1])
    return np.where(above.max(axis=1) >= level, position, np.nan)


def _ends(view: StripView, arcs: Arcs, thickness: float, width: float) -> tuple[Array, Array]:
    """Return root and tip, (2, 2) [m], and how sure they are along the strip, (2,) [m].

    An end that faces the point below the camera shows its end face, which makes it uncertain by
    as much as that face is long in the picture.
    """
    at = np.array([0.0, arcs.length])
    out = arcs.tangents_at(at) * np.array([[-1.0], [1.0]])
    ends = arcs.points_at(at)
    found = np.array(
        [
            _last_seen(view, end, way, normal * thickness)
            for end, way, normal in zip(ends, out, arcs.normals_at(at), strict=True)
        ]
    )
    below, height = view.below()
    facing = -np.sum((ends - below) * out, axis=1) * width / height
    noise = np.hypot(_END_NOISE_M, np.maximum(facing, 0.0))
    lost = ~np.isfinite(found)
    return ends + np.where(lost, 0.0, found)[:, None] * out, np.where(lost, 0.01, noise)


def _last_seen(view: StripView, end: Array, way: Array, across: Array) -> float:
    """Return how far beyond an end the strip ends, on its way from inside out [m]; NaN if unseen.

    Args:
        view: of the photograph.
        end: (2,) of the strip as known so far.
        way: (2,) unit vector out of it.
        across: (2,) its thickness as a vector.
    """
    offsets = np.arange(-_END_REACH_M, _END_REACH_M, _STEP_M)
    lines = end + np.linspace(-0.2, 0.2, 5)[:, None, None] * across + offsets[:, None] * way
    strength = np.median(view.at(lines), axis=0).astype(float)
    ground = float(np.percentile(strength, 5))
    top = float(np.median(strength[offsets < -_END_REACH_M / 2])) - ground
    below = (strength - ground < _HALF * top) & (offsets > -_END_REACH_M / 2)
    return float(offsets[np.argmax(below)]) if below.any() else np.nan
