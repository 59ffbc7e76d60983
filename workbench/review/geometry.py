"""Where the drawn parts of the robot are, from the channels of a motion.

Angles turn about +y, so a direction at angle a points along (cos a, 0, -sin a) on the bench.
Yaw and roll are not drawn: the robot moves in the x-z plane.
"""

from __future__ import annotations

from itertools import count, takewhile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.motion import CORNER_FORCES, FOOT, PITCH, position
from workbench.review.comparison import Figure
from workbench.shape import curve
from workbench.timeseries import TimeSeries

__all__ = [
    "beam_points",
    "beam_root",
    "foot_corners",
    "foot_pitch",
    "ground_forces",
    "pitch_quaternions",
]


def foot_pitch(motion: TimeSeries) -> NDArray[np.float64]:
    """Return the foot's pitch, (n,) [rad]; zero where it was not measured."""
    if PITCH not in motion:
        return np.zeros(len(motion))
    return np.where(motion.validity(PITCH), motion[PITCH], 0.0)


def pitch_quaternions(pitch: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations about +y as xyzw, (n, 4), the order that the viewer wants."""
    zero = np.zeros_like(pitch)
    return np.column_stack([zero, np.sin(pitch / 2), zero, np.cos(pitch / 2)])


def beam_root(motion: TimeSeries, figure: Figure) -> NDArray[np.float64]:
    """Return where the beam leaves the foot, (n, 3) [m], NaN where the foot was not seen."""
    return position(motion, FOOT) + figure.beam_root * _directions(foot_pitch(motion))


def beam_points(twin: TimeSeries, figure: Figure) -> NDArray[np.float64]:
    """Return the beam as a chain of N equal increments, (n, N + 1, 3) [m].

    Raises:
        ValueError: when the twin carries no hinge angles.
    """
    names = list(takewhile(twin.__contains__, (f"hinge_{k}_rad" for k in count())))
    if not names:
        raise ValueError(
            f"the twin has no column hinge_0_rad, so its beam cannot be drawn; "
            f"there are {', '.join(twin.names)}"
        )
    angles = twin.select(names).values.copy()
    angles[:, 0] += foot_pitch(twin)
    chain = curve(angles, figure.beam_length)
    level = np.zeros((*chain.shape[:-1], 1))
    return beam_root(twin, figure)[:, None, :] + np.concatenate(
        [chain[..., :1], level, chain[..., 1:]], axis=-1
    )


def ground_forces(
    motion: TimeSeries, figure: Figure
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return where the ground pushes the foot and how, both (n, 4, 3) [m] and [N].

    None where the motion carries no such forces: a clamped twin, and every real robot.
    """
    if any(name not in motion for names in CORNER_FORCES for name in names):
        return None
    forces = np.stack([motion.select(names).values for names in CORNER_FORCES], axis=1)
    sides = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])  # as `motion.CORNER_FORCES` has them
    halves = sides * np.array([figure.foot_length, figure.foot_width]) / 2
    return foot_corners(motion, halves), forces


def foot_corners(motion: TimeSeries, places: ArrayLike) -> NDArray[np.float64]:
    """Return where places on the foot are, (n, k, 3) [m], NaN where it was not seen.

    Args:
        motion: of the foot.
        places: (k, 2), forward and left of the foot's centre [m].
    """
    forward, left = np.asarray(places, dtype=float).T
    along = forward[:, None] * _directions(foot_pitch(motion))[:, None, :]
    across = np.column_stack([np.zeros_like(left), left, np.zeros_like(left)])
    return position(motion, FOOT)[:, None, :] + along + across


def _directions(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=-1)
