"""The pose of a body from its markers: weighted least squares over rotations (Kabsch, Wahba).

Solved for all samples with the same visible markers at once by Markley's FOAM (J. Astronaut. Sci.
41, 1993, "Attitude determination using vector observations: a fast optimal matrix algorithm"): a
fit takes 0.5 us, with a stack of singular value decompositions 2.5 us, and they agree to 2e-15.
`Rotation.align_vectors`, which takes one sample at a time, is the tests' cross-check.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.take import known

__all__ = ["Poses", "fit_poses", "on_a_line", "pitch_of"]

_FLAT = 1e-2  # second singular value over the first; below it the markers are on a line
_MOST_STEPS = 30  # Newton's; three or four are usual
_CONVERGED = 1e-14
_FEW = 16  # markers whose patterns are counted rather than sorted
_BLOCK = 8192  # samples fitted at a time, so that they stay in the cache


class Poses(NamedTuple):
    """n poses: (n, 3) origin [m], (n, 3, 3) body-to-bench matrix, (n,) misfit [m]; NaN if none."""

    origin: NDArray[np.float64]
    matrix: NDArray[np.float64]
    rmsd: NDArray[np.float64]


def fit_poses(
    places: NDArray[np.float64],
    cloud: NDArray[np.float64],
    weights: NDArray[np.float64] | None = None,
) -> Poses:
    """Fit a body's pose to its visible markers, sample by sample.

    Args:
        places: (m, 3) markers in the body's frame [m]; a marker whose place is NaN is left out.
        cloud: (n, m, 3) the same markers seen [m], NaN where not.
        weights: (m,) above 0, how much each marker counts; all the same if None.

    Returns:
        Poses, NaN where fewer than three markers are visible or they lie on a line. The misfit is
        the weighted root mean square distance of the visible markers to their places.
    """
    n, m = cloud.shape[:2]
    fitted, place, count = np.empty((13, n + 1)), np.full(n, -1), 0
    fitted[:, -1] = np.nan  # of samples without a pose
    weights = np.ones(m) if weights is None else weights
    visible = known(cloud) & known(places)
    pattern = np.einsum("nm,m->n", visible, 1 << np.arange(m))
    bench = np.ascontiguousarray(np.moveaxis(cloud, 0, -1))  # (m, 3, n)
    for code in np.flatnonzero(np.bincount(pattern)) if m < _FEW else np.unique(pattern):
        shown = np.flatnonzero(code >> np.arange(m) & 1)
        if on_a_line(places[shown]):
            continue
        alike, own = np.flatnonzero(pattern == code), bench if len(shown) == m else bench[shown]
        place[alike] = np.arange(count, count + len(alike))
        for start in range(0, len(alike), _BLOCK):
            seen = own.take(alike[start : start + _BLOCK], axis=2)
            some = slice(count, count + seen.shape[2])
            fitted[:, some] = _fit(places[shown], seen, weights[shown])
            count = some.stop
    fitted = fitted.take(place, axis=1)  # samples run along the fast axis
    return Poses(fitted[:3].T, fitted[3:12].reshape(3, 3, n).transpose(2, 0, 1), fitted[12])


def pitch_of(forward: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation about +y, (n,) [rad], of +x into directions (n, 3): towards -z."""
    return np.arctan2(-forward[:, 2], forward[:, 0])


def on_a_line(places: NDArray[np.float64]) -> bool:
    """Return whether places (m, 3) span no plane: too few of them, or all along one line."""
    if len(places) < 3:
        return True
    singular = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    return bool(singular[1] <= _FLAT * singular[0])


def _fit(
    places: NDArray[np.float64], bench: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return poses (13, n), origin, matrix and misfit, of samples (m, 3, n), which are used up."""
    share = weights / weights.sum()
    middle = share @ places
    body = places - middle  # (m, 3)
    centre = np.einsum("m,min->in", share, bench)
    bench -= centre
    moment = np.einsum("min,mj->ijn", bench, share[:, None] * body)
    size = np.sqrt((share @ _square(bench)) * (share @ np.sum(body**2, axis=1)))
    matrix = _rotations(moment, size)
    bench -= np.einsum("ijn,mj->min", matrix, body)
    origin = centre - np.einsum("ijn,j->in", matrix, middle)
    rmsd = np.sqrt(share @ _square(bench))
    return np.vstack([origin, matrix.reshape(9, -1), rmsd])


def _square(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared lengths (..., n) of vectors (..., 3, n)."""
    return np.einsum("...in,...in->...n", vectors, vectors)


def _rotations(moment: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations (3, 3, n) that maximise the trace of their product with the moments.

    Args:
        moment: (3, 3, n) sums of weighted outer products, bench times body.
        size: (n,) upper bounds of that trace, where Newton's iteration starts.
    """
    cofactors = np.empty_like(moment)
    for i, j in np.ndindex(3, 3):
        a, b = moment[i - 2], moment[i - 1]
        cofactors[i, j] = a[j - 2] * b[j - 1] - a[j - 1] * b[j - 2]
    determinant = np.einsum("in,in->n", moment[0], cofactors[0])
    square = _square(moment).sum(axis=0)
    trace = _largest_root(size, square, determinant, _square(cofactors).sum(axis=0))
    half = (trace**2 - square) / 2
    gram = np.einsum("ijn,kjn->ikn", moment, moment)
    top = (half + square) * moment
    top += trace * cofactors
    top -= np.einsum("ikn,kjn->ijn", gram, moment)
    with np.errstate(divide="ignore", invalid="ignore"):  # markers that all coincide
        top /= half * trace - determinant
    return top


def _largest_root(
    start: NDArray[np.float64],
    square: NDArray[np.float64],
    determinant: NDArray[np.float64],
    cofactor_square: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the largest root (n,) of FOAM's quartic by Newton's iteration from above."""
    root = start
    for _ in range(_MOST_STEPS):
        over = root**2 - square
        value = over**2 - 8 * root * determinant - 4 * cofactor_square
        slope = 4 * root * over - 8 * determinant
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(slope > 0, value / slope, 0.0)
        root = root - step
        if np.all(np.abs(step) <= _CONVERGED * root):
            break
    return root
