"""Euler angles as the exporters print them."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["euler_degrees"]


def euler_degrees(quaternion: NDArray[np.float64], order: str) -> NDArray[np.float64]:
    """Return angles about the body's own axes, in the order given, (n, 3) [deg], NaN where unknown.

    Args:
        quaternion: (n, 4) w, x, y, z.
        order: e.g. "XYZ".
    """
    angles = np.full((len(quaternion), 3), np.nan)
    norm = np.linalg.norm(np.nan_to_num(quaternion), axis=1)
    known = norm > 1e-6
    if not known.any():
        return angles
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # gimbal lock: one of many right answers
        turned = Rotation.from_quat(quaternion[known], scalar_first=True)
        angles[known] = turned.as_euler(order, degrees=True)
    return angles
