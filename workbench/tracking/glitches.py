"""Glitches: seen samples that are spikes, bursts or at impossible distances."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.noise import robust_sigma
from workbench.tracking.take import known, samples_of, time_last

__all__ = ["bursts", "off_length", "out_of_reach", "spikes", "strays"]

Array = NDArray[np.float64]

_WINDOW = 5
_FAR_M = 4e-3  # at 120 Hz landings leave running medians by 2 mm, a rotor at 21 rad/s by 0.5 mm
_FAR_SCALES = 8.0
_FASTEST_M_S = 5.0  # the rotor moves at about 1 m/s
_GREATEST_M_S2 = 40.0  # of landings; the rotor's own is 15
_BURST_S = 0.1
_PULL_M = 1.5e-3  # at 120 Hz landings are up to 0.5 mm off the curve, as is noise of 0.2 mm
_RESOLVING_HZ = 120.0
_BACK = 0.5  # of the first jump: how near the path comes to where it would have been
_ROUNDS = 5


def spikes(times: Array, path: Array, least: float = _FAR_M) -> NDArray[np.bool_]:
    """Find samples far from the running median of five: (n,) True for one or two strays in a row.

    Far is 4 mm, or eight times the usual deviation where that is more, plus the distance that the
    body travels at its greatest usual speed while it is not seen. Samples between strays are
    checked again without them.

    Args:
        times: (n,) increasing [s].
        path: (n, d) [m] or another unit, NaN where not seen.
        least: deviation that is never far, in that unit.
    """
    seen = np.flatnonzero(known(path))
    found = np.zeros(len(path), dtype=bool)
    for _ in range(_ROUNDS):
        if len(seen) < _WINDOW:
            break
        own = samples_of(path, seen)
        apart = _length(_off_median(own))
        far = apart > (bound := _far(apart, least))
        if far.any():
            far = apart > bound + _unseen_way(times[seen], own)
        if not far.any():
            break
        found[seen[far]] = True
        seen = seen[~far]
    return found


def bursts(times: Array, path: Array) -> NDArray[np.bool_]:
    """Find stretches of up to 0.1 s off the path, (n,).

    Either between two jumps faster than 5 m/s; or between a jump out and a jump back. A jump is a
    step that differs from the running median of five steps by 4 mm, or by eight times the usual
    difference where that is more. The median follows a landing, which changes the speed for good.

    Args:
        times: (n,) increasing [s].
        path: (n, 3) [m], NaN where not seen.
    """
    seen = np.flatnonzero(known(path))
    found = np.zeros(len(path), dtype=bool)
    if len(seen) < 2:
        return found
    lasted = np.diff(times[seen])
    velocity = np.diff(samples_of(path, seen), axis=0) / lasted[:, None]
    _mark_fast(found, seen, times, _length(velocity) > _FASTEST_M_S)
    if len(seen) > _WINDOW:
        _mark_returned(found, seen, times, _off_median(velocity) * lasted[:, None], lasted)
    return found


def out_of_reach(path: Array, anchor: Array, allowed: tuple[float, float]) -> NDArray[np.bool_]:
    """Find samples whose distance to an anchor is out of bounds, (n,).

    Args:
        path: (n, 3) [m], NaN where not seen.
        anchor: (n, 3) [m], NaN where not seen; False there.
        allowed: least and greatest distance [m].
    """
    distance = _length(path - anchor)
    return (distance < allowed[0]) | (distance > allowed[1])


def off_length(top: Array, rotor: Array) -> NDArray[np.bool_]:
    """Find samples whose arm from T to the rotor has not its usual length, (n,).

    The arm is rigid. Off is 4 mm, or eight times the usual deviation where that is more. Either of
    the two bodies may be wrong.

    Args:
        top: (n, 3) [m], NaN where not seen; False there.
        rotor: (n, 3) [m], likewise.
    """
    length = _length(rotor - top)
    seen = np.isfinite(length)
    found = np.zeros(len(length), dtype=bool)
    if seen.any():
        off = np.abs(length[seen] - np.median(length[seen]))
        found[seen] = off > _far(off)
    return found


def strays(path: Array, curve: Array, seen: NDArray[np.bool_], rate: float) -> NDArray[np.bool_]:
    """Find the samples that pull a smooth curve away from their neighbours, (n,).

    A sample pulls when it lies off the curve by 1.5 mm (more where the cameras are slower than
    120 Hz), or by eight times the usual distance where that is more, and further than its
    neighbours, which are checked again against a curve without it.

    Args:
        path: (n, 3) [m]; ignored at samples not seen.
        curve: (n, 3) [m], finite at seen samples.
        seen: (n,).
        rate: [Hz].
    """
    apart = np.where(seen, _length(path - curve), 0.0)
    far = apart > _far(apart[seen], _PULL_M * max(1.0, _RESOLVING_HZ / rate) ** 2)
    if not far.any():
        return far
    return far & (apart == scipy.ndimage.maximum_filter1d(apart, _WINDOW))


def _length(vectors: Array) -> Array:
    """Return the lengths of (n, 3) vectors; a third of the time of `numpy.linalg.norm`."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def _off_median(values: Array) -> Array:
    """Return the deviations of values (n, d) from their running medians of five, (n, d)."""
    from workbench.tracking.loops import median_of_five

    columns = time_last(values)
    return (columns - median_of_five(columns)).T


def _far(apart: Array, least: float = _FAR_M) -> float:
    """Return the limit of deviations (n,): the least that is far, or eight times the usual one."""
    # the usual one costs a sort, and where none exceeds the least nothing is far
    return max(least, _FAR_SCALES * float(robust_sigma(apart))) if (apart > least).any() else least


def _unseen_way(times: Array, path: Array) -> Array:
    """Return how far a body may have gone unseen within each window of five, (n,) [m]."""
    lasted = np.diff(times)
    speed = float(np.percentile(_length(np.diff(path, axis=0)) / lasted, 95))
    before = np.concatenate([[0.0], np.cumsum(np.maximum(lasted - 1.5 * np.median(lasted), 0.0))])
    last = len(times) - 1
    at = np.arange(len(times))
    half = _WINDOW // 2
    return speed * (before[np.minimum(at + half, last)] - before[np.maximum(at - half, 0)])


def _mark_fast(
    found: NDArray[np.bool_], seen: NDArray[np.intp], times: Array, fast: NDArray[np.bool_]
) -> None:
    """Mark short pieces between impossible speeds; the longest piece is never one of them."""
    if not fast.any():
        return
    pieces = np.split(seen, np.flatnonzero(fast) + 1)
    longest = max(pieces, key=len)
    for piece in pieces:
        if piece is not longest and times[piece[-1]] - times[piece[0]] < _BURST_S:
            found[piece] = True


def _mark_returned(
    found: NDArray[np.bool_], seen: NDArray[np.intp], times: Array, excess: Array, lasted: Array
) -> None:
    """Mark what lies between a jump and the jump that undoes it.

    In a longer step than usual a body may deviate more from a straight path.
    """
    size = _length(excess)
    bound = _far(size)
    if not (size > bound).any():
        return
    bend = 0.5 * _GREATEST_M_S2 * (lasted**2 - np.median(lasted) ** 2)
    jumps = np.flatnonzero(size > bound + np.maximum(bend, 0.0))
    aside = np.concatenate([np.zeros((1, 3)), np.cumsum(excess, axis=0)])
    done = -1
    for number, out in enumerate(jumps):
        if out <= done:
            continue
        for back in jumps[number + 1 :]:
            if times[seen[back]] - times[seen[out]] > _BURST_S:
                break
            if np.linalg.norm(aside[back + 1] - aside[out]) < _BACK * size[out]:
                found[seen[out + 1 : back + 1]] = True
                done = back
                break
