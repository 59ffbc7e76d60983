"""The pose of a body from its markers: weighted least squares over rotations (Kabsch, Wahba).

Solved by Markley's FOAM (J. Astronaut. Sci. 41, 1993, "Attitude determination using vector
observations: a fast optimal matrix algorithm"), compiled: a fit takes 0.1 us, with a stack of
singular value decompositions 2.5 us, and they agree to 2e-15. `Rotation.align_vectors`, which takes
one sample at a time, is the tests' cross-check.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.take import known, time_last

__all__ = ["Poses", "fit_poses", "on_a_line", "pitch_of"]

_FLAT = 1e-2  # second singular value over the first; below it the markers are on a line


class Poses(NamedTuple):
    """Poses of a body in n samples, NaN where there is none.

    Args:
        origin: (n, 3) [m].
        matrix: (n, 3, 3) from the body to the bench [1].
        rmsd: (n,) misfit [m].
    """

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
        weights: (m,) above 0, how much each marker counts [1]; all the same if None.

    Returns:
        Poses, NaN where fewer than three markers are visible or they lie on a line. The misfit is
        the weighted root mean square distance of the visible markers to their places.
    """
    from workbench.tracking.loops import fit, visible

    seen = time_last(cloud)
    pattern = visible(seen, known(places))
    bits = np.arange(len(places))
    for kind in np.unique(pattern):
        if kind and on_a_line(places[kind >> bits & 1 == 1]):
            pattern[pattern == kind] = 0
    fitted = np.empty((13, len(pattern)))
    weights = np.ones(len(places)) if weights is None else weights
    fit(np.ascontiguousarray(places), np.asarray(weights, dtype=float), seen, pattern, fitted)
    return Poses(fitted[:3].T, fitted[3:12].reshape(3, 3, -1).transpose(2, 0, 1), fitted[12])


def pitch_of(forward: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation about +y, (n,) [rad], of +x into directions: towards -z.

    Args:
        forward: (n, 3) directions [any unit].
    """
    return np.arctan2(-forward[:, 2], forward[:, 0])


def on_a_line(places: NDArray[np.float64]) -> bool:
    """Return whether places span no plane: too few of them, or all along one line.

    Args:
        places: (m, 3) [m].
    """
    if len(places) < 3:
        return True
    singular = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    return bool(singular[1] <= _FLAT * singular[0])
