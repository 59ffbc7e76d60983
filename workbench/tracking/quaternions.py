"""Euler angles as exporters print them, and the check of quaternions that are read."""

from __future__ import annotations

import warnings

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.tracking.take import known

__all__ = ["euler_degrees", "usable"]

_LEAST_LENGTH = 0.5  # printed digits leave a unit quaternion within 1e-5 of 1


def euler_degrees(quaternion: NDArray[np.float64], order: str) -> NDArray[np.float64]:
    """Return angles about the body's own axes, in the order given, (n, 3) [deg], NaN where unknown.

    Args:
        quaternion: (n, 4) w, x, y, z [1].
        order: e.g. "XYZ".
    """
    angles = np.full((len(quaternion), 3), np.nan)
    given = known(quaternion)
    if not given.any():
        return angles
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # gimbal lock: one of many right answers
        turned = scipy.spatial.transform.Rotation.from_quat(quaternion[given], scalar_first=True)
        angles[given] = turned.as_euler(order, degrees=True)
    return angles


def usable(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions, (n, 4) [1], with NaN in place of those that are no rotation.

    Args:
        quaternion: (n, 4) [1].
    """
    square = np.einsum("nk,nk->n", quaternion, quaternion)
    whole = (square > _LEAST_LENGTH**2) & np.isfinite(square)
    return np.where(whole[:, None], quaternion, np.nan)
