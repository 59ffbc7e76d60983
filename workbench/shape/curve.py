"""From angles to the curve of the beam."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["bend_radii", "curve"]


def curve(angles: ArrayLike, length: float) -> NDArray[np.float64]:
    """Return the ends of the increments from the beam's root, (..., N + 1, 2) as x, z [m].

    An increment at angle a about +y points along (cos a, -sin a) (thesis, figure 2.4).

    Args:
        angles: (..., N) alpha_0 to alpha_{N-1} [rad].
        length: of the whole beam [m].
    """
    direction = np.cumsum(np.asarray(angles, dtype=float), axis=-1)
    step = length / direction.shape[-1]
    increments = step * np.stack([np.cos(direction), -np.sin(direction)], axis=-1)
    root = np.zeros((*increments.shape[:-2], 1, 2))
    return np.concatenate([root, np.cumsum(increments, axis=-2)], axis=-2)


def bend_radii(angles: ArrayLike, length: float) -> NDArray[np.float64]:
    """Return the radius of curvature at each joint but the root's, (..., N - 1) [m].

    The bend of a joint is spread over one increment's length; a straight joint is infinite.

    Args:
        angles: (..., N) alpha_0 to alpha_{N-1} [rad].
        length: of the whole beam [m].
    """
    bends = np.abs(np.asarray(angles, dtype=float))
    step = length / bends.shape[-1]
    with np.errstate(divide="ignore"):
        return step / bends[..., 1:]
