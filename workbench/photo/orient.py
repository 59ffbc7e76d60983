"""Which end of a strip is its root, and which of its two edges lies down: by the shape it has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.photo.fit import StripPoints

__all__ = ["oriented", "rough_numbers"]

Array = NDArray[np.float64]

_CLEARLY = 0.8  # of the second best misfit, that the best must stay below
_ENOUGH = 400  # points; of more, only some are taken
_SMOOTHING = 0.5  # of an increment, over which a heading is taken


def rough_numbers(positions: Array, length: float, half_thickness: float) -> Array:
    """Return numbers of `StripFit`, (20,) [m, rad, 1], for a rough path, root first.

    Args:
        positions: (n, 2) along the centreline [m].
        length: of the strip [m].
        half_thickness: as seen [m].
    """
    sparse = positions[:: max(1, len(positions) // _ENOUGH)]
    steps = np.linalg.norm(np.diff(sparse, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    along *= 16 / along[-1]
    middle = np.arange(0.5, 16.0)

    def at(where: Array) -> Array:
        return np.column_stack([np.interp(where, along, column) for column in sparse.T])

    step = at(middle + _SMOOTHING) - at(middle - _SMOOTHING)
    headings = np.unwrap(np.arctan2(-step[:, 1], step[:, 0]))
    angles = np.diff(headings, prepend=0.0)
    return np.concatenate([positions[0], angles, [0.0, half_thickness]])


def oriented(
    name: str,
    points: StripPoints,
    length: float,
    target: NDArray[np.float64],
    foot: Callable[[float], float] | None,
) -> tuple[StripPoints, bool]:
    """Return the points root first and as seen from the drawn side, and whether they were mirrored.

    Args:
        name: of the file, for messages.
        points: in either order, from either side.
        length: of the strip [m].
        target: (16,) angles that the strip should have [rad].
        foot: from a heading to the angle at the foot, when the way forward is known; the strip
            then is not mirrored.

    Raises:
        InputError: when the strip looks alike from both ends or both sides.
    """
    trials = [(points, False), (points.reversed(), False)]
    if foot is None:
        trials += [(one.mirrored(), True) for one, _ in trials]
    misfits = [_misfit(one, length, target, foot) for one, _ in trials]
    best, second = np.sort(misfits)[:2]
    if best > _CLEARLY * second:
        raise InputError(
            f"{name}: root and tip, or the strip's two sides, cannot be distinguished: it is "
            f"{np.degrees(best):.0f} and {np.degrees(second):.0f} deg a joint off the target; "
            "see that the target is the right one, or say which way is forward (--foot aligned, "
            "--forward and --up)"
        )
    return trials[int(np.argmin(misfits))]


def _misfit(
    points: StripPoints,
    length: float,
    target: NDArray[np.float64],
    foot: Callable[[float], float] | None,
) -> float:
    """Return by how much the angles miss the target, rms [rad]."""
    angles = rough_numbers(points.positions, length, 0.0)[2:18].copy()
    first = 0 if foot is not None else 1
    if foot is not None:
        angles[0] = foot(float(angles[0]))
    difference = angles - target
    difference[0] = (difference[0] + np.pi) % (2 * np.pi) - np.pi
    return float(np.sqrt(np.mean(difference[first:] ** 2)))
