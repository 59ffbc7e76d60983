"""Identity of markers: exchanges of slots found by continuity and undone.

A tracker labels markers anew in every frame and sometimes exchanges two of them for a while. In an
exchange markers leave their positions and others arrive there. Shape alone does not show it: a
rectangle fits itself in four ways. So samples are compared with those just before them, about the
markers' common centroid, and a stretch gets another order only where that order continues the
motion and the order of the file does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.tracking.take import known, time_last

__all__ = ["Untangled", "exchange_summary", "untangle"]

Array = NDArray[np.float64]

_LEFT = 0.5  # of the least marker distance: further off, a marker is nearer to another's place
_ARRIVED = 0.25  # of the least marker distance: nearer, a marker continues another's path
_SHORT_S = 0.025  # a rotor at 21 rad/s turns by half a radian
_LONGEST_S = 0.2
_TRIED = 500  # samples for the usual displacement of markers
_LAGS = 8
_LOOK_BACK = 3  # stretches; one or two of strays may lie between


class Untangled(NamedTuple):
    """Markers of a body after exchanges were undone.

    Args:
        cloud: (n, m, 3) markers, each in its own slot [m].
        exchanged: (n,) True where an exchange was undone.
    """

    cloud: Array
    exchanged: NDArray[np.bool_]


def untangle(times: Array, cloud: Array, *, partly: bool = True) -> Untangled:
    """Find exchanges of markers and undo them.

    Among samples that can be compared the most frequent order counts as right. After a gap in which
    the body may have turned, the order stays as in the file.

    Args:
        times: (n,) [s].
        cloud: (n, m, 3) markers in the file's slots [m], NaN where not seen.
        partly: whether samples that show only some markers are compared too, with paths between
            samples at most 0.2 s apart that show all.

    Returns:
        The markers; the cloud itself where there was nothing to undo.
    """
    from workbench.tracking.loops import whole

    n, m = cloud.shape[:2]
    unchanged, never = np.broadcast_to(np.arange(m), (n, m)), np.zeros(n, dtype=np.bool_)
    rows = np.flatnonzero(whole(time_last(cloud)))
    if len(rows) < 2 or m < 2:
        return Untangled(cloud, never)
    nearest = _least_distance(cloud[rows[:: max(1, len(rows) // _TRIED)]])
    order = unchanged
    cuts = _cuts(cloud, rows, nearest)
    found = _by_continuity(_Motion(times, cloud, rows, nearest), cuts) if len(cuts) else None
    if found is not None:
        order = unchanged.copy()
        order[rows] = found
    by_paths = _by_paths(times, cloud, rows, order, nearest) if partly else {}
    if by_paths:
        order = order.copy()
        order[list(by_paths)] = list(by_paths.values())
    exchanged = never if order is unchanged else (order != unchanged).any(axis=1)
    if not exchanged.any():
        return Untangled(cloud, never)
    return Untangled(np.take_along_axis(cloud, order[:, :, None], axis=1), exchanged)


def exchange_summary(
    times: Array, exchanged: NDArray[np.bool_], whose: str, what: str = "markers"
) -> str | None:
    """Return a sentence on the exchanges undone, or None where there were none.

    Args:
        times: (n,) [s].
        exchanged: (n,) where an exchange was undone.
        whose: the body.
        what: was exchanged.
    """
    count = int(np.count_nonzero(exchanged))
    if not count:
        return None
    stretches = int(np.count_nonzero(np.diff(exchanged.astype(np.int8), prepend=0) == 1))
    first = float(times[np.argmax(exchanged)])
    return (
        f"{whose}: {what} exchanged in {count} samples ({stretches} stretches, the first at "
        f"{first:.3f} s); undone"
    )


def _least_distance(some: Array) -> float:
    """Return the usual distance of the two markers that are nearest to each other [m]."""
    first, second = np.triu_indices(some.shape[1], k=1)
    return float(np.median(np.linalg.norm(some[:, first] - some[:, second], axis=2), axis=0).min())


def _cuts(cloud: Array, rows: NDArray[np.intp], nearest: float) -> NDArray[np.intp]:
    """Return the places in `rows` at which a marker has left its place since the one before."""
    from workbench.tracking.loops import steady

    limit = _LEFT * nearest
    still = steady(time_last(cloud), limit / 2)  # what moves less in space is no candidate
    places = np.flatnonzero(~still[rows[1:]]) + 1
    before, after = (_about_middle(cloud[rows[each]]) for each in (places - 1, places))
    far = np.linalg.norm(after - before, axis=2) > limit
    return places[far.any(axis=1)]


def _about_middle(full: Array) -> Array:
    """Return markers (k, m, 3) about their common centroid."""
    return full - np.einsum("kmi->ki", full)[:, None] / full.shape[1]


def _by_continuity(motion: _Motion, cuts: NDArray[np.intp]) -> NDArray[np.intp] | None:
    """Return slots (k, m) of samples that show all markers, None where each keeps its own."""
    starts, stops = np.r_[0, cuts], np.r_[cuts, len(motion)]
    orders, group = _linked(motion, starts, stops)
    if (orders == np.arange(orders.shape[1])).all():
        return None
    for name in np.unique(group):
        members = np.flatnonzero(group == name)
        kinds, kind = np.unique(orders[members], axis=0, return_inverse=True)
        weights = (stops - starts)[members]
        usual = kinds[np.argmax(np.bincount(kind.ravel(), weights=weights))]
        orders[members] = orders[members][:, np.argsort(usual)]
    return np.repeat(orders, stops - starts, axis=0)


def _linked(
    motion: _Motion, starts: NDArray[np.intp], stops: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the slots (p, m) of each piece against the first of its group, and its group (p,)."""
    count, m = len(starts), motion.cloud.shape[1]
    orders, group = np.tile(np.arange(m), (count, 1)), np.arange(count)
    for i in range(1, count):
        for j in range(i - 1, max(-1, i - 1 - _LOOK_BACK), -1):
            last, first = int(stops[j]) - 1, int(starts[i])
            if not motion.comparable(last, first):
                break
            before, after = motion.shape(np.array([last, first]))
            order = _continued(before[orders[j]], after, motion.nearest)
            if order is not None:
                group[i], orders[i] = group[j], order
                break
    return orders, group


@dataclass(frozen=True, eq=False)
class _Motion:
    """The k samples that show all markers.

    Args:
        times: (n,) [s].
        cloud: (n, m, 3) [m].
        rows: (k,) those samples.
        nearest: least distance of two markers [m].
    """

    times: Array
    cloud: Array
    rows: NDArray[np.intp]
    nearest: float

    def __len__(self) -> int:
        """Return k."""
        return len(self.rows)

    def shape(self, places: NDArray[np.intp]) -> Array:
        """Return the markers about their centroid in some of the k samples, (len(places), m, 3)."""
        return _about_middle(self.cloud[self.rows[places]])

    def comparable(self, last: int, first: int) -> bool:
        """Return whether the markers hardly move in the time between two samples."""
        gap = float(self.times[self.rows[first]] - self.times[self.rows[last]])
        return (
            gap <= _SHORT_S or self._usual_move(round(gap / self._step)) < _ARRIVED * self.nearest
        )

    @cached_property
    def _step(self) -> float:
        return float(np.median(np.diff(self.times[self.rows])))

    @cached_property
    def _usual_moves(self) -> dict[int, float]:
        return {}

    def _usual_move(self, lag: int) -> float:
        """Return how far the marker that moves most usually gets within a lag [m]."""
        if lag >= len(self):
            return np.inf
        if lag not in self._usual_moves:
            # a body that has turned once is where it was: shorter lags count as well
            tried = np.unique(np.linspace(1, lag, _LAGS).astype(np.intp))
            self._usual_moves[lag] = max(self._median_move(int(each)) for each in tried)
        return self._usual_moves[lag]

    def _median_move(self, lag: int) -> float:
        some = np.arange(lag, len(self), max(1, len(self) // _TRIED))
        moved = np.linalg.norm(self.shape(some) - self.shape(some - lag), axis=2)
        return float(np.median(moved.max(axis=1)))


def _continued(before: Array, after: Array, nearest: float) -> NDArray[np.intp] | None:
    """Return the slot of `after` that continues each marker of `before`; None if not all do."""
    apart = scipy.spatial.distance.cdist(before, after)
    marker, slot = scipy.optimize.linear_sum_assignment(apart**2)
    return slot if (apart[marker, slot] <= _ARRIVED * nearest).all() else None


def _by_paths(
    times: Array, cloud: Array, rows: NDArray[np.intp], slots: NDArray[np.intp], nearest: float
) -> dict[int, NDArray[np.intp]]:
    """Return slots (m,) of samples with hidden markers whose visible ones sit on others' paths.

    `rows` are the samples that show all markers, from `slots` (n, m).
    """
    some = np.setdiff1d(np.arange(len(cloud)), rows, assume_unique=True)
    after = np.searchsorted(rows, some)
    inside = (after > 0) & (after < len(rows))
    some, after = some[inside], after[inside]
    left, right = rows[after - 1], rows[after]
    t, t0, t1 = times[some], times[left], times[right]
    close = t1 - t0 <= _LONGEST_S
    share = ((t - t0) / (t1 - t0))[:, None, None]
    start, end = (np.take_along_axis(cloud[i], slots[i][:, :, None], axis=1) for i in (left, right))
    paths = start * (1 - share) + end * share
    off = np.linalg.norm(cloud[some] - paths, axis=2)
    suspect = close & (off > _LEFT * nearest).any(axis=1)
    found: dict[int, NDArray[np.intp]] = {}
    for i in np.flatnonzero(suspect):
        shown = np.flatnonzero(known(cloud[some[i]]))
        apart = scipy.spatial.distance.cdist(cloud[some[i], shown], paths[i])
        slot, marker = scipy.optimize.linear_sum_assignment(apart**2)
        if (apart[slot, marker] <= _ARRIVED * nearest).all():
            order = np.full(cloud.shape[1], -1)
            order[marker] = shown[slot]
            order[order < 0] = np.setdiff1d(np.arange(cloud.shape[1]), shown)
            if (order != np.arange(len(order))).any():
                found[int(some[i])] = order
    return found
