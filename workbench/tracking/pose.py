"""The pose of a body from its markers: least squares over rotations (Kabsch).

Solved for all samples with the same visible markers at once; `Rotation.align_vectors`, which takes
one sample at a time, is the tests' cross-check.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.take import known

__all__ = ["Poses", "fit_poses", "pitch_from_matrices"]

_FLAT = 1e-3  # second singular value over the first; below it the markers are on a line


class Poses(NamedTuple):
    """n poses: (n, 3) origin [m], (n, 3, 3) body-to-bench matrix, (n,) misfit [m]; NaN if none."""

    origin: NDArray[np.float64]
    matrix: NDArray[np.float64]
    rmsd: NDArray[np.float64]


def fit_poses(places: NDArray[np.float64], cloud: NDArray[np.float64]) -> Poses:
    """Fit a body's pose to its visible markers, sample by sample.

    Args:
        places: (m, 3) markers in the body's frame [m].
        cloud: (n, m, 3) the same markers seen [m], NaN where not.

    Returns:
        Poses, NaN where fewer than three markers are visible or they lie on a line.
    """
    n = len(cloud)
    poses = Poses(np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan), np.full(n, np.nan))
    visible = known(cloud)
    for pattern in np.unique(visible, axis=0):
        if np.count_nonzero(pattern) < 3 or _on_a_line(places[pattern]):
            continue
        samples = np.flatnonzero((visible == pattern).all(axis=1))
        fitted = _fit(places[pattern], cloud[np.ix_(samples, np.flatnonzero(pattern))])
        for kept, new in zip(poses, fitted, strict=True):
            kept[samples] = new
    return poses


def pitch_from_matrices(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation about +y, (n,) [rad]: how far +x has turned towards -z."""
    return np.arctan2(-matrix[:, 2, 0], matrix[:, 0, 0])


def _fit(places: NDArray[np.float64], seen: NDArray[np.float64]) -> Poses:
    body, bench = places - places.mean(axis=0), seen - seen.mean(axis=1, keepdims=True)
    u, _, vt = np.linalg.svd(np.swapaxes(bench, 1, 2) @ body)  # (n, 3, 3)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]  # a rotation, never a mirror image
    matrix = u @ vt
    misfit = bench - body @ np.swapaxes(matrix, 1, 2)
    rmsd = np.sqrt(np.mean(np.sum(misfit**2, axis=2), axis=1))
    return Poses(seen.mean(axis=1) - matrix @ places.mean(axis=0), matrix, rmsd)


def _on_a_line(places: NDArray[np.float64]) -> bool:
    singular = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    return bool(singular[1] <= _FLAT * singular[0])
