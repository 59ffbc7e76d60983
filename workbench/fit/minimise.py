"""The minimiser: Gauss-Newton steps within a trust region, for expensive residuals.

    cost(x) = sum of rho(r_i(x)),   rho(r) = 2 c^2 (sqrt(1 + (r / c)^2) - 1)   (soft L1)

A prior's c is infinite, so that rho(r) = r^2: a number may be as far off as its prior says, however
wild the data.

The region is a ball in the minimiser's numbers, prior deviations, so that its first radius does not
depend on where the origin is. A step that is predicted to lower the cost by little is far inside
every interval: with H = J' w J, the decrease s' H s that is left is the squared distance to the
minimum in standard errors.

A Jacobian costs several times what residuals do. It is kept as long as its steps lower the cost,
brought up to date by what they did to the residuals (Broyden, Math. Comp. 19, 1965, 577; `Blocks`).
That also measures slopes over the length of a step, where differences over a hair see single kinks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.fit.blocks import Blocks

__all__ = ["CLOSE", "ROUGH", "Minimum", "minimum", "soft", "weights"]

Array = NDArray[np.float64]

_RADIUS = 1.0  # prior deviations
_GOOD, _POOR = 0.75, 0.25  # share of the predicted decrease that came
_KINKED = 2  # shorter and shorter steps with a fresh Jacobian that raise the cost: it has a kink
_EDGE = 0.9  # of the radius: a longer step was held back by it

CLOSE = 0.1
"""Squared distance to the minimum that may be left, in standard errors."""

ROUGH = 1.0
"""The same where the process noise is far from its final size."""


class Minimum(NamedTuple):
    """Where a minimiser ended.

    Args:
        x: (p,) numbers [prior deviations].
        residuals: (m,) there [sigma].
        jacobian: (m, p) of the residuals [1], or what it was brought up to date to.
        evaluations: of the residuals.
        converged: whether no step promises to lower the cost.
        cost: the sum of robust squares there.
    """

    x: Array
    residuals: Array
    jacobian: Array
    evaluations: int
    converged: bool
    cost: float


def soft(residuals: Array, scale: float | Array) -> Array:
    """Return the robust squares of residuals, (m,) [1]: r^2 near zero, 2 c r far beyond c.

    Args:
        residuals: (m,) [sigma].
        scale: c, one or (m,) [sigma]; infinite is not robust.
    """
    # the module's rho, without a difference of large numbers, so that c may be infinite
    return 2 * residuals**2 / (1 + np.sqrt(1 + (residuals / scale) ** 2))


def weights(residuals: Array, scale: float | Array) -> Array:
    """Return the weight of each square by `soft`, rho'(r) / 2 r, (m,) [1].

    Args:
        residuals: (m,) [sigma].
        scale: c, one or (m,) [sigma]; infinite is not robust.
    """
    return np.asarray(1 / np.sqrt(1 + (residuals / scale) ** 2))


def minimum(
    residuals: Callable[[Array], Array],
    derivative: Callable[[Array], Array],
    start: Array,
    bounds: tuple[Array, Array],
    scale: float | Array,
    most: int,
    near: float = CLOSE,
    jacobian: Array | None = None,
    radius: float = _RADIUS,
    edges: Sequence[int] = (),
) -> Minimum:
    """Return the least robust cost within bounds.

    Args:
        residuals: (m,) [sigma] at numbers (p,).
        derivative: their Jacobian, (m, p) [1].
        start: (p,) within the bounds [prior deviations].
        bounds: least and greatest numbers, (p,) each [prior deviations].
        scale: c, one or (m,); residuals beyond it pull less.
        most: evaluations of the residuals.
        near: squared distance to the minimum that may be left, in standard errors.
        jacobian: (m, p) near the start [1], where one is known.
        radius: of the first region, in prior deviations.
        edges: (b + 1,) between blocks of residuals that depend on few numbers each.
    """
    x, fresh, failed = start.copy(), jacobian is None, 0
    r = residuals(x)
    cost, count = float(np.sum(soft(r, scale))), 1
    slopes = Blocks.of(derivative(x) if jacobian is None else jacobian, edges)
    while True:
        normal = slopes.normal(r, weights(r, scale))
        converged = _step(x, *normal, bounds, np.inf)[1] < near
        step, predicted = _step(x, *normal, bounds, radius)
        if converged or count >= most or predicted < near or failed == _KINKED:
            return Minimum(x, r, slopes.dense(), count, converged, cost)
        tried = residuals(x + step)
        value = float(np.sum(soft(tried, scale)))
        count += 1
        share = (cost - value) / predicted
        length = float(np.linalg.norm(step))
        failed = failed + 1 if fresh and share <= 0 else 0
        if share > _GOOD and length > _EDGE * radius:
            radius *= 2
        elif share < _POOR and fresh:
            radius = length / 4
        if share > 0:
            slopes, fresh = slopes.updated(tried - r, step), False
            x, r, cost = x + step, tried, value
        if share < _POOR and not (fresh and share <= 0):
            slopes, fresh = Blocks.of(derivative(x), edges), True


def _step(
    x: Array, gradient: Array, curvature: Array, bounds: tuple[Array, Array], radius: float
) -> tuple[Array, float]:
    """Return the step of the least predicted cost within region and bounds, and its decrease.

    The step itself counts as a residual: it is no longer, in prior deviations, than it lowers the
    cost, so that numbers of which the residuals say nothing stay where they are.
    """
    curvature = curvature + np.eye(len(x))
    free, step = np.ones(len(x), dtype=np.bool_), np.zeros(len(x))
    low, high = bounds[0] - x, bounds[1] - x
    for _ in range(len(x) + 1):
        rest = gradient + curvature @ np.where(free, 0.0, step)
        left = np.sqrt(max(radius**2 - float(np.sum(step[~free] ** 2)), 0.0))
        step[free] = _within(curvature[np.ix_(free, free)], rest[free], left)
        outside = free & ((step < low) | (step > high))
        if not outside.any():
            break
        step = np.clip(step, low, high)
        free &= ~outside
    return step, float(-2 * gradient @ step - step @ curvature @ step)


def _within(curvature: Array, gradient: Array, radius: float) -> Array:
    """Return the step that lowers g's + s'Hs/2 most within a radius."""
    if not len(gradient):
        return gradient
    values, vectors = np.linalg.eigh(curvature)
    values = np.maximum(values, 1e-12 * max(float(values[-1]), 1e-300))
    along = vectors.T @ gradient

    def beyond(damping: float) -> float:
        return float(np.linalg.norm(along / (values + damping))) - radius

    damping = 0.0
    if beyond(0.0) > 0:
        most = float(np.linalg.norm(along)) / max(radius, 1e-300)
        damping = float(scipy.optimize.brentq(beyond, 0.0, most, xtol=1e-9 * most))
    return np.asarray(-vectors @ (along / (values + damping)), dtype=np.float64)
