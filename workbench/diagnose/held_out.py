"""How likely runs are that no fit has seen, given those that were fitted.

    p(unseen | fitted) = integral of p(unseen | theta) p(theta | fitted) d theta

By Laplace's method, with P the precision of theta after the fit, J the derivatives of the unseen
runs' whitened innovations and t where the integrand is greatest:

    -2 ln p = -2 ln L(t) + (t - found)' P (t - found) + ln det(P + J'J) - ln det P

(MacKay, Neural Computation 4, 1992, 415). What each run has of its own has its prior for P. Judged
at the numbers that were found alone, a hypothesis pays for what the fitted runs left open: near a
resonance a tilt that was there lost 28 to a base that made up for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.hypothesis import Hypothesis, blocks_of
from workbench.fit import (
    NEAREST,
    ROBUST,
    ROUGH,
    Estimator,
    ParameterVector,
    eliminated,
    minimum,
    reaches,
)

__all__ = ["root_of", "unseen"]

Array = NDArray[np.float64]

_STEPS = 4  # evaluations; what is unseen moves the numbers by little
_FLAT = 1e-4  # precision of what the fitted runs do not feel [1 / prior deviation^2]


def unseen(one: Hypothesis, estimator: Estimator) -> tuple[Array, ...]:
    """Return -2 ln p of each second, (b,) [1], of each run of an estimator.

    What the numbers themselves cost is spread evenly over the seconds.

    Args:
        one: a hypothesis as fitted.
        estimator: of runs that it has not seen, with its process noise.
    """
    vector = estimator.vector
    start, (root, steps) = vector.named(one.values), _posterior(one, vector)
    rows, cheap = estimator.edges[-2], estimator.near(start)
    found = minimum(
        lambda x: np.concatenate([cheap.residuals(x)[:rows], root @ (x - start)]),
        lambda x: np.concatenate([estimator.jacobian(x, None, steps)[:rows], root]),
        start, vector.bounds, np.repeat([ROBUST, np.inf], [rows, len(root)]), _STEPS, ROUGH,
    )  # fmt: skip
    moved = float(np.sum((root @ (found.x - start)) ** 2))
    spread = _log_det(found.jacobian.T @ found.jacobian) - _log_det(root.T @ root)
    runs = estimator.innovations(found.x, keep=True)
    blocks = [blocks_of(run, estimator.system.sample_s) for run in runs]
    each = (moved + spread) / sum(len(run) for run in blocks)
    return tuple(run + each for run in blocks)


def _posterior(one: Hypothesis, vector: ParameterVector) -> tuple[Array, Array]:
    """Return a root of the numbers' precision after a fit, (p, p), and how far to move them, (p,).

    The precision is R'R [1].
    """
    fitted, jacobian = one.estimator.vector, one.jacobian
    known = eliminated(jacobian.T @ jacobian, fitted.own)
    names = [p.name for p in fitted.shared]
    order, shared = [names.index(p.name) for p in vector.shared], np.ix_(~vector.own, ~vector.own)
    root, steps = np.eye(len(vector)), np.full(len(vector), NEAREST)
    root[shared] = root_of(known[np.ix_(order, order)])
    steps[~vector.own] = reaches(jacobian)[~fitted.own][order]
    return root, steps


def root_of(precision: Array) -> Array:
    """Return R, (p, p), with R'R the precision, at least `_FLAT` along each direction.

    Where runs say much of their own numbers, what is left for shared ones is a small difference,
    and rounding may take it below nothing.
    """
    values, ways = np.linalg.eigh((precision + precision.T) / 2)
    return np.asarray(np.sqrt(np.maximum(values, _FLAT))[:, None] * ways.T, dtype=np.float64)


def _log_det(matrix: Array) -> float:
    return float(np.linalg.slogdet(matrix)[1])
