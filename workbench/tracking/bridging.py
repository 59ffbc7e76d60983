"""A body's point while some of its markers are hidden, from the visible ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.take import known

__all__ = ["Bridge", "Offsets", "bridge"]

Array = NDArray[np.float64]

_LONGEST_S = 0.1
_WORST_M = 2e-3  # half of what cleaning takes for a stray
_TRIED = 1000  # samples for the speed at which a body turns


Offsets = Callable[[NDArray[np.intp]], Array]
"""Returns (k, m, 3) offsets of markers from the point in k samples [m]; NaN where unknown."""


class Bridge(NamedTuple):
    """Points of a track, some of them extrapolated.

    Args:
        position: (n, 3) [m].
        bridged: (n,) True where one was extrapolated.
        error: of doing so [m].
    """

    position: Array
    bridged: NDArray[np.bool_]
    error: float


def bridge(times: Array, cloud: Array, position: Array, about: Offsets) -> Bridge:
    """Extrapolate a point from the visible markers where too few of them determine it.

    A marker's offset from the point turns with the body. Over a gap it is interpolated, beside a
    longer one it is held, over the lags at which this predicts the take's own offsets within 2 mm
    (root mean square), and never beyond 0.1 s.

    Args:
        times: (n,) [s].
        cloud: (n, m, 3) markers [m], NaN where not seen; the point stays NaN where all are NaN.
        position: (n, 3) the point [m], NaN where unknown.
        about: of the same markers; where the point is known, so are always the same ones of them.
    """
    given = known(position)
    anchors = np.flatnonzero(given)
    used = known(about(anchors[:1])).any(axis=0)
    wanted = np.flatnonzero(~given)
    wanted = wanted[known(cloud[wanted][:, used]).any(axis=1)]
    bridged = np.zeros(len(times), dtype=np.bool_)
    if not len(wanted) or len(anchors) < 2:
        return Bridge(position, bridged, 0.0)
    step = float(np.median(np.diff(times)))
    most = max(1, round(_LONGEST_S / step))
    between, held = (
        _reach(lambda i: about(anchors[i])[:, used], len(anchors), most, one)
        for one in (False, True)
    )
    right = np.searchsorted(anchors, wanted)
    left, right = np.maximum(right - 1, 0), np.minimum(right, len(anchors) - 1)
    before = np.abs(times[wanted] - times[anchors[left]]) / step
    after = np.abs(times[anchors[right]] - times[wanted]) / step
    inside = (left < right) & (np.maximum(before, after) <= between[0] + 0.5)
    beside = np.minimum(before, after) <= held[0] + 0.5
    share = np.where(inside, before / np.maximum(before + after, 1), before > after)
    on_left, on_right = (about(anchors[end])[:, used] for end in (left, right))
    carried = _turned(on_left, on_right, share)
    good = inside | beside
    position, bridged[wanted[good]] = position.copy(), True
    position[bridged] = _mean_of_seen(cloud[wanted][:, used] - carried)[good]
    error = max(held[1] * bool((beside & ~inside).any()), between[1] * bool(inside.any()))
    return Bridge(position, bridged, error)


def _reach(about: Offsets, count: int, most: int, one_sided: bool) -> tuple[int, float]:
    """Return the lag [samples] up to which offsets are predicted well, and the error there [m]."""
    reach, error = 0, 0.0
    for lag in range(1, most + 1):
        middle = np.arange(lag, count - lag, max(1, count // _TRIED))
        if not len(middle):
            break
        guess = about(middle - lag)
        if not one_sided:
            guess = (guess + about(middle + lag)) / 2
        off = float(np.sqrt(np.mean(np.sum((about(middle) - guess) ** 2, axis=2))))
        if off > _WORST_M:
            break
        reach, error = lag, max(error, off)
    return reach, error


def _turned(left: Array, right: Array, share: Array) -> Array:
    """Return offsets (k, m, 3) between two, of their mean length: bodies never shrink."""
    share = share[:, None, None]
    mixed = left * (1 - share) + right * share
    length = np.linalg.norm(mixed, axis=2, keepdims=True)
    ends = np.linalg.norm(np.stack([left, right]), axis=3).mean(axis=0)[..., None]
    return mixed * np.divide(ends, length, out=np.ones_like(length), where=length > 0)


def _mean_of_seen(points: Array) -> Array:
    """Return the mean (k, 3) of the visible ones of points (k, m, 3)."""
    shown = known(points)[..., None]
    return np.where(shown, points, 0.0).sum(axis=1) / shown.sum(axis=1)
