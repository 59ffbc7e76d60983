"""What tests of recovery share: noise of a known size, a minimiser, what it found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from workbench.fit import Estimator, MjcfSystem, ParameterVector

__all__ = ["fitted", "noise_like", "ratios"]

Array = NDArray[np.float64]


def noise_like(values: Array, sigma: float, rng: np.random.Generator) -> Array:
    """Return white noise whose root mean square is exactly sigma, for sharp ratios."""
    noise = rng.normal(size=values.shape)
    return sigma * noise / np.sqrt(np.mean(noise**2, axis=0))


def fitted(
    system: MjcfSystem,
    noise: Mapping[str, float],
    start: Array | float = 0.0,
    tolerance: float = 1e-4,
) -> tuple[dict[str, float], Array, Estimator]:
    """Return the values by name, the minimiser's numbers and the estimator."""
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, noise, threads=1)
    at = np.broadcast_to(start, len(vector))
    derivatives: Any = estimator.jacobian
    x = least_squares(
        estimator.residuals, at, derivatives, bounds=vector.bounds, xtol=tolerance, ftol=tolerance
    ).x
    return {p.name: value for p, value in vector.values(x).items()}, x, estimator


def ratios(estimator: Estimator, x: Array) -> Array:
    """Return the root mean square of each run's whitened innovations, of the channels seen."""
    return np.array(
        [
            np.sqrt(np.mean(one.white[np.isfinite(one.error)] ** 2))
            for one in estimator.innovations(x)
        ]
    )
