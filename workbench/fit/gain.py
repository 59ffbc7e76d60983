"""How sure the observer is of its state before a sample, from the Riccati equation.

The robot about its rest, in coordinates z = (c, c') of its lowest modes: with mass-normal modes,

    z[k+1] = A z[k] + w,   c'' = -w_m^2 c - 2 zeta w_m c' + f,   f white, cov(f) = basis' q^2 basis

q is the process noise of each degree of freedom [N m sqrt(s)] or [N sqrt(s)]: forces that the model
lacks. P, the covariance before a sample, is the stationary one of the Kalman filter: it solves the
discrete algebraic Riccati equation (Anderson and Moore, Optimal Filtering, 1979, eq. 4.4.2). The
correction acts in the span of these modes only: one of all joints would kick modes of kilohertz.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["Gain", "Modes", "stationary"]

Array = NDArray[np.float64]

_SLOWEST = 1e-3  # [rad/s] a mode without a spring gets this one, or the equation has no solution


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest modes of a system about its rest.

    Args:
        basis: (nv, m) columns with basis' M basis = 1.
        stiffness: (m, m) basis' K basis [1/s^2].
        damping: (m, m) basis' D basis [1/s].
        slopes: (c, m) derivative of the channels by the modes' coordinates at rest.
        rates: (c, m) the same by the coordinates' rates; None where no rate is seen.
    """

    basis: Array
    stiffness: Array
    damping: Array
    slopes: Array
    rates: Array | None = None

    def transition(self, seconds: float) -> Array:
        """Return A, (2 m, 2 m), over a time."""
        count = len(self.stiffness)
        drift = _SLOWEST**2 * np.eye(count)
        rates = np.block([
            [np.zeros((count, count)), np.eye(count)],
            [-self.stiffness - drift, -self.damping - _SLOWEST * np.eye(count)],
        ])  # fmt: skip
        return np.asarray(scipy.linalg.expm(rates * seconds), dtype=np.float64)

    def kicks(self, process: Array, seconds: float) -> Array:
        """Return Q, (2 m, 2 m): what white forces of deviation `process`, (nv,), do in a time."""
        force = self.basis.T @ (process[:, None] ** 2 * self.basis)
        t = seconds
        return np.asarray(np.kron([[t**3 / 3, t**2 / 2], [t**2 / 2, t]], force), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Gain:
    """What the correction needs to know of a run: modes, covariance and noise.

    Args:
        basis: (nv, m).
        covariance: (2 m, 2 m) of z before a sample.
        noise: (c,) variance of the channels.
    """

    basis: Array
    covariance: Array
    noise: Array


def stationary(modes: Modes, process: Array, sigma: Array, seconds: float) -> Gain:
    """Return the stationary gain.

    Args:
        modes: of the system.
        process: (nv,) process noise of each degree of freedom; zero everywhere makes no correction.
        sigma: (c,) standard deviation of the channels' noise.
        seconds: from one sample to the next.
    """
    size = 2 * modes.basis.shape[1]
    if not process.any():
        return Gain(modes.basis, np.zeros((size, size)), sigma**2)
    rates = np.zeros_like(modes.slopes) if modes.rates is None else modes.rates
    slopes = np.hstack([modes.slopes, rates])
    covariance = scipy.linalg.solve_discrete_are(
        modes.transition(seconds).T, slopes.T, modes.kicks(process, seconds), np.diag(sigma**2)
    )
    return Gain(modes.basis, (covariance + covariance.T) / 2, sigma**2)
