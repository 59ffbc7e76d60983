"""How sure a fit is, counting what the model misses.

With J the Jacobian, r the residuals and w their robust weights, the parameters' covariance is

    C = B^-1 (M + G G') B^-1,   B = J' w J + priors,   M = n / (n - 1) sum over blocks g g' + priors

g = J' w r of a block of one second (the sandwich; White, Econometrica 50, 1982, 1). Where the
innovations are white M and B agree and C = B^-1; where the model misses something they
remember each other, and the blocks know of it. A prior enters with its own spread. G is the whole
gradient: next to zero where a fit came to rest; where one stopped at a kink of the cost, as hops
have, what it would still move counts as an error.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.fit.estimator import ROBUST
from workbench.fit.fitting import Fit
from workbench.fit.minimise import weights
from workbench.fit.parameters import Parameter

__all__ = ["BLOCK_S", "Covariance", "Interval", "covariance", "intervals"]

Array = NDArray[np.float64]

_FEW, _INSTEAD = 8, 16  # fewer blocks of a run do not show how they scatter: shorter ones then

BLOCK_S = 1.0
"""Longer than what the cameras' noise and the robot's faster modes remember [s]."""


class Interval(NamedTuple):
    """A fitted value and where it lies with 90 % confidence."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Covariance:
    """Of the minimiser's numbers.

    Args:
        matrix: (p, p) the sandwich [1].
        information: (p, p) B: what the data and the priors say, for white innovations [1].
        blocks: how many there were.
    """

    matrix: Array
    information: Array
    blocks: int


def covariance(fit: Fit) -> Covariance:
    """Return the covariance of a fit's numbers."""
    estimator, vector = fit.estimator, fit.vector
    weighted = vector.weighted
    residuals, jacobian = fit.residuals, fit.jacobian
    data = len(residuals) - int(weighted.sum())
    scaled = jacobian[:data] * weights(residuals[:data], ROBUST)[:, None]
    prior = np.diag(weighted.astype(np.float64))
    information = jacobian[:data].T @ scaled + prior
    slopes = []
    begin = 0
    for one in fit.innovations:
        count, channels = one.white.shape
        pieces = round(count * estimator.system.sample_s / BLOCK_S)
        pieces = pieces if pieces >= _FEW else _INSTEAD
        edges = begin + channels * np.linspace(0, count, pieces + 1).round().astype(int)
        slopes += [scaled[a:b].T @ residuals[a:b] for a, b in pairwise(edges)]
        begin += count * channels
    scores = np.array(slopes)
    number, whole = len(scores), scores.sum(axis=0) + prior @ fit.x
    middle = number / (number - 1) * scores.T @ scores + prior + np.outer(whole, whole)
    inverse = np.linalg.pinv(information, hermitian=True)
    return Covariance(inverse @ middle @ inverse, information, number)


def intervals(fit: Fit, found: Covariance) -> dict[Parameter, Interval]:
    """Return value and 90 % interval of every parameter.

    The quantile is Student's with as many degrees of freedom as there are blocks less one. An error
    is never less than what white innovations would leave: scattering blocks can agree by chance.
    """
    reach = float(scipy.stats.t.ppf(0.95, max(found.blocks - 1, 1)))
    white = np.diag(np.linalg.pinv(found.information, hermitian=True))
    error = np.sqrt(np.maximum(np.diag(found.matrix), white))
    return {
        p: Interval(p.value(x), p.value(x - reach * e), p.value(x + reach * e))
        for p, x, e in zip(fit.vector.parameters, map(float, fit.x), map(float, error), strict=True)
    }
