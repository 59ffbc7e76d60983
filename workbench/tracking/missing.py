"""Missing samples of a Motive body, and gaps.

Motive writes blank cells for a lost body, except for solved bodies (format 1.24): there a zero pose
is written before the first sighting, and the last pose is repeated after a loss.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.take import SampleStatus, known

__all__ = ["gaps", "motive_missing", "never_moves", "runs", "without_zeros"]

Array = NDArray[np.float64]

_FROZEN_S = 0.04
_FROZEN_SAMPLES = 5  # shorter exact repeats occur in real files of bodies that were seen
_STILL_SAMPLES = 3


def motive_missing(
    position: Array, quaternion: Array, measured: Array, rate: float, *, others_raw: bool = False
) -> NDArray[np.int8]:
    """Return (n,) values of `SampleStatus`.

    Raw markers decide where the file has them. Without them a repeated pose counts as frozen only
    from 0.04 s on (at least 5 samples), and never from the body's first pose: that body may still
    be at rest. But where other bodies have raw markers, one without them that has a single pose all
    through was never tracked.

    Args:
        position: (n, 3) NaN where blank [m].
        quaternion: (n, 4) w, x, y, z [1].
        measured: (n, m, 3) raw markers, NaN where not seen [m].
        rate: [Hz].
        others_raw: whether the file has raw markers of other bodies.
    """
    missing = np.zeros(len(position), dtype=np.int8)
    visible = np.asarray(known(measured).any(axis=1), dtype=np.bool_)
    has_raw = bool(visible.any())
    repeat = _repeats(position, quaternion)
    if has_raw:
        missing[~visible] = SampleStatus.LOST
        missing[~visible & repeat] = SampleStatus.FROZEN
    zero = _is_zero_pose(position, quaternion) & ~(has_raw & visible)
    missing[zero] = SampleStatus.PLACEHOLDER
    missing[~known(position)] = SampleStatus.BLANK
    if has_raw:
        return missing
    least = max(_FROZEN_SAMPLES, round(_FROZEN_S * rate))
    _mark_frozen(missing, repeat, least)
    seen = missing == SampleStatus.SEEN
    if others_raw and never_moves(position[seen], quaternion[seen]):
        missing[seen] = SampleStatus.FROZEN
    return missing


def never_moves(position: Array, quaternion: Array) -> bool:
    """Return whether poses are one and the same; three at the least.

    Args:
        position: (k, 3) [m].
        quaternion: (k, 4) w, x, y, z [1].
    """
    poses = np.hstack([position, np.nan_to_num(quaternion)])
    return len(poses) >= _STILL_SAMPLES and bool((poses == poses[0]).all())


def without_zeros(
    points: Array, whose: str, indices: NDArray[np.int64], warn: Callable[[str], None]
) -> Array:
    """Return points, (n, k, 3) [m], with NaN for exact zeros, which exporters write for NaN.

    Args:
        points: (n, k, 3) [m], NaN where not seen.
        whose: markers, for the warning.
        indices: (n,) of the frames, for the warning.
        warn: takes the warning.
    """
    zero = points[..., 0] == 0
    if zero.any():
        zero &= (points[..., 1] == 0) & (points[..., 2] == 0)
    count = int(np.count_nonzero(zero))
    if not count:
        return points
    first = indices[int(np.argmax(zero.any(axis=1)))]
    warn(
        f"{whose} stand at exactly 0, 0, 0 in {count} sample(s), first at frame {first}; these "
        "count as not seen"
    )
    return np.where(zero[..., None], np.nan, points)


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return start and stop (one past the end) of each run of True.

    Args:
        mask: (n,) any.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def gaps(seen: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the number of gaps and the length of the longest one in samples.

    Args:
        seen: (n,) True where seen.
    """
    lengths = [stop - start for start, stop in runs(~seen)]
    return len(lengths), max(lengths, default=0)


def _repeats(position: Array, quaternion: Array) -> NDArray[np.bool_]:
    same = np.zeros(len(position), dtype=bool)
    alike = np.arange(1, len(position))
    for column in position.T:  # what differs in one of them is not looked at again
        alike = alike[column[alike] == column[alike - 1]]
    before, after = (np.nan_to_num(quaternion[i]) for i in (alike - 1, alike))
    same[alike] = (before == after).all(axis=1)
    return same


def _is_zero_pose(position: Array, quaternion: Array) -> NDArray[np.bool_]:
    zero = (position[:, 0] == 0) & (position[:, 1] == 0) & (position[:, 2] == 0)
    turn = quaternion[zero]
    zero[zero] = np.isnan(turn).any(axis=1) | (turn[:, 1:] == 0).all(axis=1)
    return zero


def _mark_frozen(missing: NDArray[np.int8], repeat: NDArray[np.bool_], least: int) -> None:
    for start, stop in runs(repeat & (missing == SampleStatus.SEEN)):
        first_pose = not (missing[: start - 1] == SampleStatus.SEEN).any()
        if stop - start >= least and not first_pose:
            missing[start:stop] = SampleStatus.FROZEN
