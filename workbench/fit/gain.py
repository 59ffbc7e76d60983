"""How sure the observer is of its state before a sample, from the Riccati equation.

The robot about its rest, in coordinates z = (c, c') of its lowest modes: with mass-normal modes,

    z[k+1] = A z[k] + w,   c'' = -w_m^2 c - 2 zeta w_m c' + f,   f white, cov(f) = basis' q^2 basis

q is the process noise of each degree of freedom [N m sqrt(s)] or [N sqrt(s)]: forces that the model
misses. P, the covariance before a sample, is the stationary one of the Kalman filter: it solves the
discrete algebraic Riccati equation (Anderson and Moore, Optimal Filtering, 1979, eq. 4.4.2). The
correction acts in the span of these modes only: one of all joints would kick modes of kilohertz.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["Gain", "Modes", "stationary"]

Array = NDArray[np.float64]

_WHITE = 1e-3  # share of noise with a memory that is white: the equation needs some
_SLOWEST = 1e-3  # [rad/s] a mode without a spring gets this one, or the equation has no solution


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest modes of a system about its rest.

    Args:
        basis: (nv, m) columns with basis' M basis = 1 [kg^-0.5].
        stiffness: (m, m) basis' K basis [s^-2].
        damping: (m, m) basis' D basis [s^-1].
        slopes: (c, m) derivative of the channels by the modes' coordinates at rest [kg^-0.5].
        rates: (c, m) the same by their rates [s kg^-0.5]; None where no rate is seen.
    """

    basis: Array
    stiffness: Array
    damping: Array
    slopes: Array
    rates: Array | None = None

    def transition(self, seconds: float) -> Array:
        """Return A, (2 m, 2 m) [unit of z by that of z], over a time."""
        count = len(self.stiffness)
        drift = _SLOWEST**2 * np.eye(count)
        rates = np.block(
            [
                [np.zeros((count, count)), np.eye(count)],
                [-self.stiffness - drift, -self.damping - _SLOWEST * np.eye(count)],
            ]
        )
        return np.asarray(scipy.linalg.expm(rates * seconds), dtype=np.float64)

    def kicks(self, process: Array, seconds: float) -> Array:
        """Return Q, (2 m, 2 m) [units of z squared]: what white forces do in a time.

        Args:
            process: (nv,) their deviation [N sqrt(s), N m sqrt(s)].
            seconds: that time.
        """
        force = self.basis.T @ (process[:, None] ** 2 * self.basis)
        t = seconds
        return np.asarray(np.kron([[t**3 / 3, t**2 / 2], [t**2 / 2, t]], force), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Gain:
    """What the correction needs to know of a run: modes, covariance and noise.

    Args:
        basis: (nv, m) of the modes [kg^-0.5].
        covariance: (2 m + v, 2 m + v) of z, and of the v = c noises with a memory if any has one,
            before a sample [their units squared].
        noise: (c,) variance of what is white of the noise [unit of the channel squared].
        memory: (c,) correlation of a channel's noise with that of the sample before [1].
        fresh: (c,) variance of what is new in noise with a memory; zeros where none has one [unit
            of the channel squared].
    """

    basis: Array
    covariance: Array
    noise: Array
    memory: Array
    fresh: Array

    def with_noises(self, transition: Array, kicks: Array, slopes: Array) -> tuple[Array, ...]:
        """Return A, Q, (..., 2 m + v, 2 m + v), H, (..., c, 2 m + v), with the noises' [as given].

        Args:
            transition: (..., 2 m, 2 m) A of the modes [unit of z by that of z].
            kicks: (..., 2 m, 2 m) Q of the modes [units of z squared].
            slopes: (..., c, 2 m) H of the modes [unit of the channel by that of z].
        """
        if not self.fresh.any():
            return transition, kicks, slopes
        alone = np.broadcast_to(np.eye(len(self.memory)), (*slopes.shape[:-1], len(self.memory)))
        return (
            _beside(transition, self.memory),
            _beside(kicks, self.fresh),
            np.concatenate([slopes, alone], axis=-1),
        )


def _beside(one: Array, diagonal: Array) -> Array:
    """Return matrices (..., a, a) with a diagonal (b,) after their own, (..., a + b, a + b)."""
    own, size = one.shape[-1], one.shape[-1] + len(diagonal)
    whole, after = np.zeros((*one.shape[:-2], size, size)), np.arange(own, size)
    whole[..., :own, :own] = one
    whole[..., after, after] = diagonal
    return whole


def stationary(
    modes: Modes, process: Array, sigma: Array, seconds: float, memory: Array | None = None
) -> Gain:
    """Return the stationary gain.

    Args:
        modes: of the system.
        process: (nv,) process noise of each degree of freedom [N sqrt(s), N m sqrt(s)]; zero
            everywhere makes no correction.
        sigma: (c,) standard deviation of the noise [unit of the channel].
        seconds: from one sample to the next.
        memory: (c,) of the noise [1]; None where it is white.
    """
    size = 2 * modes.basis.shape[1]
    begin = Gain(modes.basis, np.zeros((size, size)), sigma**2, 0 * sigma, 0 * sigma)
    if memory is not None and memory.any():
        fresh = (1 - memory**2) * (1 - _WHITE) * sigma**2
        begin = replace(begin, noise=_WHITE * sigma**2, memory=memory, fresh=fresh)
    elif not process.any():
        return begin
    rates = np.zeros_like(modes.slopes) if modes.rates is None else modes.rates
    step, kicks, slopes = begin.with_noises(
        modes.transition(seconds), modes.kicks(process, seconds), np.hstack([modes.slopes, rates])
    )
    moving = slice(0 if process.any() else size, None)  # without process noise z is known
    covariance = np.zeros_like(step)
    covariance[moving, moving] = scipy.linalg.solve_discrete_are(
        step[moving, moving].T, slopes[:, moving].T, kicks[moving, moving], np.diag(begin.noise)
    )
    return replace(begin, covariance=(covariance + covariance.T) / 2)
