"""A straight line through speeds at voltages, with the scatter that no run's own error explains.

The speed of one run is known far better than one run repeats another: brushes, battery and room
change. So every run has the variance s^2 + tau^2, its own and one that all share; tau is what makes
chi^2 equal to the degrees of freedom (Paule and Mandel 1982). Where the runs agree better than
their own errors say, tau is zero and nothing is made smaller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.motion import Mode

__all__ = [
    "CONFIDENCE",
    "LEAST_ERROR",
    "LineInterval",
    "SpeedLine",
    "SpeedPoint",
    "WeightedFit",
    "fit_line",
    "fitted",
]

CONFIDENCE = 0.9
LEAST_ERROR = 1e-6  # [rad/s]; an error of zero would be an infinite weight


@dataclass(frozen=True)
class SpeedPoint:
    """One run in the plane of voltage and speed.

    Args:
        name: of the run.
        voltage: at the motor [V].
        speed: of its shaft, whichever way it turned [rad/s].
        standard_error: of that speed within the run [rad/s].
        mode: what the robot did.
        sense: 1 where the rotor's angle grew, -1 where it fell.
        hours: time of day from some zero [h], NaN where not known.
        source: of the voltage, `read back` or `asked`.
    """

    name: str
    voltage: float
    speed: float
    standard_error: float
    mode: Mode = "clamped"
    sense: int = 1
    hours: float = float("nan")
    source: str = "read back"


class LineInterval(NamedTuple):
    """A number and what holds the truth with 90 %."""

    value: float
    low: float
    high: float


class WeightedFit(NamedTuple):
    """A linear fit with a common scatter.

    Args:
        coefficients: (p,) [unit of each].
        covariance: (p, p) of them, scatter included [their units squared].
        scatter: standard deviation tau.
        birge: square root of chi^2 over the degrees of freedom without the scatter.
        degrees: of freedom.
    """

    coefficients: NDArray[np.float64]
    covariance: NDArray[np.float64]
    scatter: float
    birge: float
    degrees: int

    def p_value(self, k: int) -> float:
        """Return how often chance alone makes coefficient k as large as it is."""
        error = float(np.sqrt(self.covariance[k, k]))
        return float(2 * scipy.stats.t.sf(abs(self.coefficients[k]) / error, self.degrees))


def fitted(
    terms: NDArray[np.float64], y: NDArray[np.float64], errors: NDArray[np.float64]
) -> WeightedFit:
    """Fit y by weighted least squares.

    Args:
        terms: (n, p) of full rank, n > p [unit of y by that of each coefficient].
        y: (n,) [any unit].
        errors: (n,) standard errors, the scatter not among them [unit of y].
    """
    degrees = len(y) - terms.shape[1]
    variances = np.maximum(errors, LEAST_ERROR) ** 2

    def chi2(scatter2: float) -> float:
        weights = 1 / np.sqrt(variances + scatter2)
        found = np.linalg.lstsq(weights[:, None] * terms, weights * y)[0]
        return float(np.sum((weights * (y - terms @ found)) ** 2))

    alone = chi2(0.0)
    scatter2 = 0.0
    if alone > degrees:
        above = float(np.sum((y - terms @ np.linalg.lstsq(terms, y)[0]) ** 2))
        scatter2 = float(
            np.asarray(
                scipy.optimize.brentq(lambda s: chi2(s) - degrees, 0.0, above + variances.max())
            )
        )
    weights = 1 / (variances + scatter2)
    covariance: NDArray[np.float64] = np.asarray(
        np.linalg.inv(terms.T @ (weights[:, None] * terms)), dtype=np.float64
    )
    coefficients = covariance @ (terms.T @ (weights * y))
    birge = np.sqrt(alone / degrees)
    return WeightedFit(coefficients, covariance, float(np.sqrt(scatter2)), float(birge), degrees)


@dataclass(frozen=True, eq=False)
class SpeedLine:
    """omega = slope U + offset (thesis, eq. 5.7), as runs have it.

    Args:
        points: that it was fitted to.
        fit: of (slope, speed at the middle voltage).
        middle: mean voltage [V].
    """

    points: tuple[SpeedPoint, ...]
    fit: WeightedFit
    middle: float

    @property
    def slope(self) -> LineInterval:
        """Return the slope [rad/s/V]."""
        return self._interval(np.array([1.0, 0.0]))

    @property
    def offset(self) -> LineInterval:
        """Return the speed where the line meets zero volts [rad/s]."""
        return self._interval(np.array([-self.middle, 1.0]))

    @property
    def scatter(self) -> float:
        """Return the scatter from run to run that no run's own error explains [rad/s]."""
        return self.fit.scatter

    @property
    def voltages(self) -> NDArray[np.float64]:
        """Return the voltages measured, (n,) [V]."""
        return np.array([point.voltage for point in self.points])

    @property
    def span(self) -> float:
        """Return how far the speeds reach along the line [rad/s]."""
        return float(self.fit.coefficients[0] * np.ptp(self.voltages))

    @property
    def residuals(self) -> NDArray[np.float64]:
        """Return measured speed less the line, (n,) [rad/s]."""
        return np.array([self.residual(point) for point in self.points])

    def residual(self, point: SpeedPoint) -> float:
        """Return what the line leaves of any run's speed [rad/s]."""
        return point.speed - float(self.at(np.array([point.voltage]))[0])

    def at(self, voltages: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the speeds of the line, (m,) [rad/s].

        Args:
            voltages: (m,) [V].
        """
        return self.fit.coefficients[0] * (voltages - self.middle) + self.fit.coefficients[1]

    def half_width(
        self, voltages: NDArray[np.float64], new_run: float | None = None
    ) -> NDArray[np.float64]:
        """Return half of the 90 % interval of the speed at voltages (m,) [rad/s].

        Args:
            voltages: (m,) [V].
            new_run: standard error of one more run [rad/s]: then the interval is that run's, with
                the scatter; without it, it is the line's.
        """
        terms = np.column_stack([voltages - self.middle, np.ones_like(voltages)])
        variance = np.einsum("ij,jk,ik->i", terms, self.fit.covariance, terms)
        if new_run is not None:
            variance = variance + self.scatter**2 + new_run**2
        return self._quantile * np.sqrt(variance)

    @property
    def _quantile(self) -> float:
        return float(scipy.stats.t.ppf((1 + CONFIDENCE) / 2, self.fit.degrees))

    def _interval(self, along: NDArray[np.float64]) -> LineInterval:
        value = float(along @ self.fit.coefficients)
        half = self._quantile * float(np.sqrt(along @ self.fit.covariance @ along))
        return LineInterval(value, value - half, value + half)


def fit_line(points: Sequence[SpeedPoint]) -> SpeedLine:
    """Fit the line.

    Args:
        points: at least three, not all at one voltage; `calibrate` asks for more than that.
    """
    volts = np.array([point.voltage for point in points])
    speeds = np.array([point.speed for point in points])
    errors = np.array([point.standard_error for point in points])
    middle = float(volts.mean())
    terms = np.column_stack([volts - middle, np.ones_like(volts)])
    return SpeedLine(tuple(points), fitted(terms, speeds, errors), middle)
