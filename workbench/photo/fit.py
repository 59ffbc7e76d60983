"""Fit equal-length arcs to points of a strip: pose, 15 bends, one scale, half the thickness.

The strip's edge that faces the camera lies in a plane above the paper. Parallel planes map onto
each other by a scaling about the point below the camera, so angles survive, and one free scale
against the known length absorbs the height.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from workbench.shape import Arcs, equal_length_arcs

__all__ = ["Points", "StripFit", "fit_strip"]

Array = NDArray[np.float64]

_BEND_PRIOR_RAD = np.radians(20.0)  # about the target: tells only where the strip is not seen
_SCALE_PRIOR = 0.1
_LEAST_NOISE_M = 1e-5
_FIRST_NOISE_M = 1e-3
_MAD = 1.4826  # of a median absolute deviation to a normal one
_CAUCHY = 2.385  # deviations beyond which a point counts less (95 % efficient, Holland 1977)
_LAG_M = 0.020  # over which residuals are still taken as one disturbance
_PERPENDICULARS = 2
_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Points:
    """What is seen of a strip, in the plane where it lies [m].

    Args:
        places: (n, 2) on its centreline or on one of its contours, in order along it.
        sides: (n,) 1 on the contour to the left of the way from root to tip, -1 to the right, 0 on
            the centreline.
        ends: (2, 2) root and tip.
        end_noise: (2,) standard deviation of where they are along the strip [m].
        half_thickness: as seen, prior mean and standard deviation [m].
        doubt: (n,) or one for all: how much less sure than the usual point each is.
    """

    places: Array
    sides: Array
    ends: Array
    end_noise: Array
    half_thickness: tuple[float, float] = (0.0, 1e-6)
    doubt: Array | float = 1.0

    def mirrored(self) -> Points:
        """Return it seen from the other side, x to -x."""
        flip = np.array([-1.0, 1.0])
        return replace(
            self, places=self.places * flip, sides=-self.sides, ends=self.ends * flip
        )

    def reversed(self) -> Points:
        """Return it with root and tip exchanged."""
        return replace(
            self,
            places=self.places[::-1],
            sides=-self.sides[::-1],
            doubt=self.doubt[::-1] if isinstance(self.doubt, np.ndarray) else self.doubt,
            ends=self.ends[::-1],
            end_noise=self.end_noise[::-1],
        )


@dataclass(frozen=True, eq=False)
class StripFit:
    """A strip as arcs.

    Args:
        numbers: (20,) root's x and z [m], 16 angles [rad] of which the first is the root's heading,
            the scale's logarithm, half the thickness as seen [m].
        covariance: (20, 20) of them.
        length: of the strip itself [m].
        noise: standard deviation of a point across the strip [m].
        likeness: how many neighbouring points err alike, at least 1.
        influence: (20, n) what a metre of each point across the strip changes.
        normals: (n, 2) across the strip at each point.
    """

    numbers: Array
    covariance: Array
    length: float
    noise: float
    likeness: float
    influence: Array
    normals: Array

    @property
    def angles(self) -> Array:
        """Return the root's heading and the 15 bends, (16,) [rad]."""
        return self.numbers[2:18]

    @property
    def scale(self) -> float:
        """Return how much larger the strip appears than it is."""
        return float(np.exp(self.numbers[18]))

    @property
    def arcs(self) -> Arcs:
        """Return its centreline as seen."""
        return _arcs(self.numbers, self.length)


def fit_strip(points: Points, length: float, start: Array, target: Array) -> StripFit:
    """Return the arcs that lie nearest to the points.

    Args:
        points: of the strip, root first, not mirrored.
        length: of the strip [m].
        start: (20,) numbers to begin at.
        target: (15,) bends that it should have [rad], a weak prior.
    """
    problem = _Problem(points, length, target, start)
    numbers, noise, trust = start, _FIRST_NOISE_M, np.ones(len(points.places))
    weights, across = trust / noise, np.zeros(len(trust))
    for _ in range(_ROUNDS):
        solution = least_squares(
            lambda trial, weights=weights: problem.residuals(trial, weights),
            numbers,
            x_scale=problem.typical,
            method="lm",  # the default decomposes far more than this needs
        )
        numbers = solution.x
        across = problem.across(numbers) / points.doubt
        noise = max(_MAD * float(np.median(np.abs(across))), _LEAST_NOISE_M)
        trust = 1 / np.sqrt(1 + (across / (_CAUCHY * noise)) ** 2)
        weights = trust / (noise * points.doubt)
    likeness = _likeness(trust * across, scaled_length(numbers, length) / len(across))
    seen = float(np.sum((trust / points.doubt) ** 2)) / likeness
    wide = np.sqrt(likeness * seen / max(seen - len(numbers), 1.0))
    jacobian = problem.jacobian(numbers, weights / wide)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    count = len(across)
    influence = covariance @ jacobian[:count].T * (weights / wide)
    normals = _arcs(numbers, length).normals_at(problem.distances)
    return StripFit(numbers, covariance, length, noise, likeness, influence, normals)


def scaled_length(numbers: Array, length: float) -> float:
    """Return the strip's length as seen [m]."""
    return float(length * np.exp(numbers[18]))


class _Problem:
    """Residuals of the fit, in standard deviations.

    Args:
        points: that are seen.
        length: of the strip [m].
        target: (15,) bends [rad].
        start: numbers whose scale and pose are near the truth.
    """

    typical = np.concatenate([[0.01, 0.01], np.full(16, 0.1), [0.01, 0.001]])

    def __init__(self, points: Points, length: float, target: Array, start: Array) -> None:
        self.points, self.length, self.target = points, length, target
        arcs = _arcs(start, length)
        dense = np.linspace(0, arcs.length, 2000)
        gap = points.places[:, None] - arcs.points_at(dense[::10])[None]
        self.distances = dense[::10][np.argmin(np.sum(gap**2, axis=-1), axis=1)]

    def across(self, numbers: Array) -> Array:
        """Return how far each point lies off its contour, (n,) [m]."""
        arcs = _arcs(numbers, self.length)
        along = self.distances
        for _ in range(_PERPENDICULARS):
            gap = self.points.places - arcs.points_at(along)
            along = along + np.sum(gap * arcs.tangents_at(along), axis=-1)
        self.distances = along
        gap = self.points.places - arcs.points_at(along)
        return np.sum(gap * arcs.normals_at(along), axis=-1) - self.points.sides * numbers[19]

    def residuals(self, numbers: Array, weights: Array) -> Array:
        """Return points, ends and priors; weights of the points are (n,) [1/m]."""
        arcs = _arcs(numbers, self.length)
        ends = np.array([0.0, arcs.length])
        gap = self.points.ends - arcs.points_at(ends)
        beyond = np.sum(gap * arcs.tangents_at(ends), axis=-1) / self.points.end_noise
        half, unsure = self.points.half_thickness
        bends = (numbers[3:18] - self.target) / _BEND_PRIOR_RAD
        priors = [numbers[18] / _SCALE_PRIOR, (numbers[19] - half) / unsure]
        return np.concatenate([self.across(numbers) * weights, beyond, bends, priors])

    def jacobian(self, numbers: Array, weights: Array) -> Array:
        """Return the derivatives of the residuals by central differences."""
        columns = []
        for k, step in enumerate(1e-4 * self.typical):
            change = np.zeros(len(numbers))
            change[k] = step
            ahead, behind = (self.residuals(numbers + s * change, weights) for s in (1, -1))
            columns.append((ahead - behind) / (2 * step))
        return np.column_stack(columns)


def _arcs(numbers: Array, length: float) -> Arcs:
    arcs = equal_length_arcs(numbers[2:18], length * float(np.exp(numbers[18])))
    return arcs.moved(0.0, numbers[:2])


def _likeness(across: Array, spacing: float) -> float:
    """Return how many neighbouring residuals count as one (Bartlett's window)."""
    centred = across - across.mean()
    variance = float(centred @ centred)
    last = min(int(_LAG_M / spacing), len(across) // 4)
    if last < 1 or variance == 0:
        return 1.0
    lags = np.arange(1, last + 1)
    alike = np.array([centred[k:] @ centred[:-k] for k in lags]) / variance
    return max(1.0, float(1 + 2 * np.sum((1 - lags / (last + 1)) * alike)))
