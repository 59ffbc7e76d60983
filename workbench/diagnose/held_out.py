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

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.hypothesis import Hypothesis, blocks_of
from workbench.fit import (
    NEAREST,
    ROBUST,
    ROUGH,
    Estimator,
    Known,
    Minimum,
    ParameterVector,
    eliminated,
    likeliest,
    minimum,
    reaches,
)

__all__ = ["known_of", "root_of", "unseen"]

Array = NDArray[np.float64]

_STEPS = 4  # evaluations; what is unseen moves the numbers by little
_FLAT = 1e-4  # precision of what the fitted runs do not feel [1 / prior deviation^2]


def unseen(one: Hypothesis, estimator: Estimator) -> tuple[Array, ...]:
    """Return -2 ln p of each second, (b,) [1], of each run of an estimator.

    The runs may ask for more process noise, where they are likelier by that at the numbers which
    they prefer. What the numbers themselves cost is spread evenly over the seconds.

    Args:
        one: a hypothesis as fitted.
        estimator: of runs that it has not seen, with its process noise.
    """
    start, (root, steps) = estimator.vector.named(one.values), _posterior(one, estimator.vector)
    found = _moved(estimator, start, start, root, steps)
    if (noisier := likeliest(estimator, found.x, down=0)) is not estimator:
        estimator, found = noisier, _moved(noisier, found.x, start, root, steps)
    moved = float(np.sum((root @ (found.x - start)) ** 2))
    spread = _log_det(found.jacobian.T @ found.jacobian) - _log_det(root.T @ root)
    runs = estimator.innovations(found.x, keep=True)
    blocks = [blocks_of(run, estimator.system.sample_s) for run in runs]
    each = (moved + spread) / sum(len(run) for run in blocks)
    return tuple(run + each for run in blocks)


def _moved(estimator: Estimator, begin: Array, known: Array, root: Array, steps: Array) -> Minimum:
    """Return the numbers that runs prefer, (p,), from some, by what is known of them."""
    rows, cheap = estimator.edges[-2], estimator.near(begin)
    return minimum(
        lambda x: np.concatenate([cheap.residuals(x)[:rows], root @ (x - known)]),
        lambda x: np.concatenate([estimator.jacobian(x, None, steps)[:rows], root]),
        begin, estimator.vector.bounds, np.repeat([ROBUST, np.inf], [rows, len(root)]), _STEPS,
        ROUGH,
    )  # fmt: skip


def _posterior(one: Hypothesis, vector: ParameterVector) -> tuple[Array, Array]:
    """Return a root of the numbers' precision after a fit, (p, p), and how far to move them, (p,).

    The precision is R'R [1].
    """
    own, shared = ~one.estimator.vector.own, np.ix_(~vector.own, ~vector.own)
    names, order = [p.name for p in vector.shared], [p.name for p in one.estimator.vector.shared]
    root, steps = np.eye(len(vector)), np.full(len(vector), NEAREST)
    root[shared] = known_of(one, names).root
    steps[~vector.own] = reaches(one.jacobian)[own][[order.index(name) for name in names]]
    return root, steps


def known_of(one: Hypothesis, names: Sequence[str]) -> Known:
    """Return what the runs of a hypothesis say of shared numbers, with its priors.

    Args:
        one: as fitted.
        names: of the numbers; the others go to their best.
    """
    vector, jacobian = one.estimator.vector, one.jacobian
    every = {p.name: k for k, p in enumerate(vector.parameters)}
    order = [every[name] for name in names]
    others = np.setdiff1d(np.arange(len(vector)), order)
    whole, order = jacobian.T @ jacobian, np.array(order, dtype=np.intp)
    ranked = np.concatenate([order, others])
    asked = np.repeat([False, True], [len(order), len(others)])
    precision = eliminated(whole[np.ix_(ranked, ranked)], asked)
    return Known(tuple(names), one.x[order], root_of(precision))


def root_of(precision: Array) -> Array:
    """Return R, (p, p), with R'R the precision, at least `_FLAT` along each direction.

    Where runs say much of their own numbers, what is left for shared ones is a small difference,
    and rounding may take it below nothing.
    """
    values, ways = np.linalg.eigh((precision + precision.T) / 2)
    return np.asarray(np.sqrt(np.maximum(values, _FLAT))[:, None] * ways.T, dtype=np.float64)


def _log_det(matrix: Array) -> float:
    return float(np.linalg.slogdet(matrix)[1])
