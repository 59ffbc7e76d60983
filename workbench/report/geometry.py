"""Where the drawn parts of the robot are, from the channels of a motion.

Angles turn about +y, so a direction at angle a points along (cos a, 0, -sin a) on the bench.
Yaw and roll are not drawn: the robot moves in the x-z plane.
"""

from __future__ import annotations

from itertools import count, takewhile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.motion import CORNER_FORCES, FOOT, PITCH, position
from workbench.report.comparison import Figure
from workbench.shape import curve
from workbench.timeseries import TimeSeries

__all__ = [
    "MISSING",
    "beam_points",
    "beam_root",
    "certainty",
    "foot_corners",
    "foot_pitch",
    "ground_forces",
    "missing_force",
    "missing_scale",
    "pitch_quaternions",
]

MISSING = {
    "top": ("missing_top_x_N", "missing_top_z_N"),
    "foot": ("missing_foot_x_N", "missing_foot_z_N"),
}
"""Point -> channels of an estimated state with the force forward and up that the model misses."""

_SURE_M, _UNSURE_M, _LEAST = 3e-4, 5e-3, 0.15
_LONGEST_M, _USUAL = 0.1, 95.0  # of an arrow, and which percentile of the forces it belongs to
_BEYOND = 2.0  # standard deviations: a smaller force may be noise


def foot_pitch(motion: TimeSeries) -> NDArray[np.float64]:
    """Return the foot's pitch, (n,) [rad]; zero where it was not measured."""
    if PITCH not in motion:
        return np.zeros(len(motion))
    return np.where(motion.validity(PITCH), motion[PITCH], 0.0)


def pitch_quaternions(pitch: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations about +y as xyzw, (n, 4) [1], the order that the viewer wants.

    Args:
        pitch: (n,) [rad].
    """
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


def certainty(estimate: TimeSeries) -> NDArray[np.float64]:
    """Return how sure each increment of an estimated beam is, (n, N) [1], from 0.15 to 1.

    1 where the place of its ends is known to 0.3 mm (a standard deviation) or better, least where
    it is known to 5 mm or worse, by the logarithm in between.
    """
    hinges = sum(1 for _ in takewhile(estimate.__contains__, (f"hinge_{k}_rad" for k in count())))
    sigma = np.stack([
        estimate[name] if (name := f"beam_{k}_sigma_m") in estimate else np.zeros(len(estimate))
        for k in range(hinges + 1)
    ], axis=1)  # fmt: skip
    worst = np.clip(np.maximum(sigma[:, 1:], sigma[:, :-1]), _SURE_M, _UNSURE_M)
    return 1 - (1 - _LEAST) * np.log(worst / _SURE_M) / np.log(_UNSURE_M / _SURE_M)


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


def missing_force(
    estimate: TimeSeries, point: str
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the force missing at a point, (n, 3) [N], and where it is no noise, (n,).

    Args:
        estimate: the estimated state.
        point: `top` or `foot`.
    """
    x, z = MISSING[point]
    force = np.stack([estimate[x], np.zeros(len(estimate)), estimate[z]], axis=1)
    sigma = [estimate[f"{n.removesuffix('_N')}_sigma_N"] for n in (x, z)]
    beyond = np.hypot(force[:, 0] / sigma[0], force[:, 2] / sigma[1]) > _BEYOND
    return force, beyond & estimate.validity(x) & np.isfinite(force).all(axis=1)


def missing_scale(estimate: TimeSeries) -> float:
    """Return how long the arrow of a missing force is [m/N]: 1, 2 or 5 times a power of ten.

    The longest such that nearly all arrows are shorter than 0.1 m.
    """
    sizes = [np.zeros(1)]
    for point in MISSING:
        if MISSING[point][0] in estimate:
            force, sure = missing_force(estimate, point)
            sizes.append(np.linalg.norm(force[sure], axis=1))
    largest = (
        float(np.percentile(np.concatenate(sizes)[1:], _USUAL)) if any(map(len, sizes[1:])) else 0.0
    )
    if not largest:
        return 1.0
    power = 10.0 ** np.floor(np.log10(_LONGEST_M / largest))
    return float(power * max(step for step in (1, 2, 5) if step * power * largest <= _LONGEST_M))


def foot_corners(motion: TimeSeries, corners: ArrayLike) -> NDArray[np.float64]:
    """Return where places on the foot are, (n, k, 3) [m], NaN where it was not seen.

    Args:
        motion: of the foot.
        corners: (k, 2), forward and left of the foot's centre [m].
    """
    forward, left = np.asarray(corners, dtype=float).T
    along = forward[:, None] * _directions(foot_pitch(motion))[:, None, :]
    across = np.column_stack([np.zeros_like(left), left, np.zeros_like(left)])
    return position(motion, FOOT)[:, None, :] + along + across


def _directions(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=-1)
