"""Fit equal-length arcs to points of a strip: pose, 15 bends, one scale, half the thickness.

The strip's edge that faces the camera lies in a plane above the paper. Parallel planes map onto
each other by a scaling about the point below the camera, so angles survive, and one free scale
against the known length absorbs the height.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.noise import robust_sigma
from workbench.shape import Arcs, equal_length_arcs

__all__ = ["StripFit", "StripPoints", "fit_strip"]

Array = NDArray[np.float64]

_BEND_PRIOR_RAD = np.radians(20.0)  # about the target: matters only where the strip is not seen
_SCALE_PRIOR = 0.1
_LEAST_NOISE_M = 1e-6
_LEAST_SLOPE = 0.1  # where most points are doubted
_FIRST_NOISE_M = 1e-3
_CAUCHY = 2.385  # deviations beyond which a point counts less (95 % efficient, Holland 1977)
_BAND = 2.5  # octave and a bit of wavelengths, beyond those that the fit can follow
_PERPENDICULARS = 2
_ROUGH = 1e-5  # of the first solution, which reweighting refines
_ROUNDS = 6


@dataclass(frozen=True, eq=False)
class StripPoints:
    """What is seen of a strip, in the plane where it lies.

    Args:
        positions: (n, 2) on its centreline or on one of its contours, in order along it [m].
        sides: (n,) 1 on the contour to the left of the way from root to tip, -1 to the right, 0 on
            the centreline [1].
        ends: (2, 2) root and tip [m].
        end_noise: (2,) standard deviation of where they are along the strip [m].
        half_thickness: as seen, prior mean and standard deviation [m].
        doubt: (n,) or one for all: how much less sure than the usual point each is [1].
    """

    positions: Array
    sides: Array
    ends: Array
    end_noise: Array
    half_thickness: tuple[float, float] = (0.0, 1e-6)
    doubt: Array | float = 1.0

    def mirrored(self) -> StripPoints:
        """Return it seen from the other side, x to -x."""
        flip = np.array([-1.0, 1.0])
        return replace(
            self, positions=self.positions * flip, sides=-self.sides, ends=self.ends * flip
        )

    def reversed(self) -> StripPoints:
        """Return it with root and tip exchanged."""
        return replace(
            self,
            positions=self.positions[::-1],
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
        covariance: (20, 20) of them [their units squared].
        length: of the strip itself [m].
        noise: standard deviation of a point across the strip [m].
        influence: (20, n) what a metre of each point across the strip changes [their units by m].
        normals: (n, 2) across the strip at each point [1].
    """

    numbers: Array
    covariance: Array
    length: float
    noise: float
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


def fit_strip(points: StripPoints, length: float, start: Array, target: Array) -> StripFit:
    """Return the arcs that lie nearest to the points.

    Args:
        points: of the strip, root first, not mirrored.
        length: of the strip [m].
        start: (20,) numbers to begin at [m, rad, 1].
        target: (15,) bends that it should have [rad], a weak prior.
    """
    problem = _Problem(points, length, target, start)
    weights = 1 / (_FIRST_NOISE_M * np.broadcast_to(points.doubt, len(points.positions)))
    numbers = scipy.optimize.least_squares(
        problem.residuals,
        start,
        args=(weights,),
        x_scale=problem.typical,
        method="lm",  # the default decomposes far more than this needs
        xtol=_ROUGH,
        ftol=_ROUGH,
    ).x
    noise, trust = _FIRST_NOISE_M, np.ones(len(weights))
    for _ in range(_ROUNDS):
        across = problem.across(numbers) / points.doubt
        noise = max(float(robust_sigma(across)), _LEAST_NOISE_M)
        trust = 1 / np.sqrt(1 + (across / (_CAUCHY * noise)) ** 2)
        weights = trust / (noise * points.doubt)
        jacobian = problem.jacobian(numbers, weights)
        downhill = jacobian.T @ problem.residuals(numbers, weights)
        numbers = numbers - np.linalg.solve(jacobian.T @ jacobian, downhill)
    across = problem.across(numbers) / points.doubt
    weights = _weights(across, trust, len(numbers)) / points.doubt
    jacobian = problem.jacobian(numbers, weights)
    covariance = np.linalg.inv(jacobian.T @ jacobian).astype(np.float64)
    influence = covariance @ jacobian[: len(across)].T * weights
    normals = _arcs(numbers, length).normals_at(problem.distances)
    return StripFit(numbers, covariance, length, noise, influence, normals)


class _Problem:
    """Residuals of the fit, in standard deviations.

    Args:
        points: that are seen.
        length: of the strip [m].
        target: (15,) bends [rad].
        start: numbers whose scale and pose are near the truth.
    """

    typical = np.concatenate([[0.01, 0.01], np.full(16, 0.1), [0.01, 0.001]])

    def __init__(self, points: StripPoints, length: float, target: Array, start: Array) -> None:
        self.points, self.length, self.target = points, length, target
        arcs = _arcs(start, length)
        dense = np.linspace(0, arcs.length, 2000)
        gap = points.positions[:, None] - arcs.points_at(dense[::10])[None]
        self.distances = dense[::10][np.argmin(np.sum(gap**2, axis=-1), axis=1)]

    def across(self, numbers: Array) -> Array:
        """Return how far each point lies off its contour, (n,) [m]."""
        arcs = _arcs(numbers, self.length)
        along = self.distances
        for _ in range(_PERPENDICULARS):
            gap = self.points.positions - arcs.points_at(along)
            along = along + np.sum(gap * arcs.tangents_at(along), axis=-1)
        self.distances = along
        gap = self.points.positions - arcs.points_at(along)
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
        """Return the derivatives of the residuals by differences."""
        here = self.residuals(numbers, weights)
        steps = 1e-5 * self.typical
        moved = [self.residuals(numbers + row, weights) for row in np.diag(steps)]
        return (np.array(moved) - here).T / steps


def _arcs(numbers: Array, length: float) -> Arcs:
    arcs = equal_length_arcs(numbers[2:18], length * float(np.exp(numbers[18])))
    return arcs.moved(0.0, numbers[:2])


def _weights(across: Array, trust: Array, parameters: int) -> Array:
    """Return by what each point counts for the covariance, (n,) [1/m].

    Huber's sandwich for Cauchy's weights: the noise of the influence over its mean slope.

    Args:
        across: (n,) residuals in order along the strip.
        trust: (n,) roots of their weights.
        parameters: of the fit.
    """
    square = trust**2
    noise = _independent_noise(square * across, parameters)
    slope = float(np.mean(square * (2 * square - 1)))
    return trust * max(slope, _LEAST_SLOPE) / (noise * np.sqrt(square.mean()))


def _independent_noise(across: Array, parameters: int) -> float:
    """Return the deviation that independent points would need to disturb the fit as these do.

    Neighbours err alike, and what they share over more than the fit's own wavelengths the fit takes
    away. So the density of power is measured just beyond these wavelengths.

    Args:
        across: (n,) residuals in order along the strip.
        parameters: of the fit; that many over two wavelengths it can follow.
    """
    count = len(across)
    white = float(across @ across) / max(count - parameters, 1)
    power = np.abs(np.fft.rfft(across)) ** 2 / count
    first = parameters // 2
    band = power[first : round(_BAND * first)]
    beyond = float(band.mean()) if len(band) else 0.0
    return max(float(np.sqrt(max(white, beyond))), _LEAST_NOISE_M)
