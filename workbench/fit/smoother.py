"""The smoother: what all samples of a run say of its state and of the forces that the model misses.

The observer knows at each sample what came before; this knows what came after as well. Its state
differs from the robot's by d, in the coordinates z = (c, c') of the modes, with its errors e,
H = dy/dz and the correction K e that it made:

    d[k+1] = A (d[k] - K e[k]) + w[k],   e[k] = H d[k] + v[k],   cov(w) = Q,   cov(v) = R

A Kalman filter of d gives the residuals r = e - H d, their covariance S and P before each sample;
where nothing is missing and P the stationary one, r = e. Then, backwards from a = B = 0,

    L = A (I - P H' S^-1 H),   a[k] = H' S^-1 r + L' a[k+1],   B[k] = H' S^-1 H + L' B[k+1] L
    smoothed d = d + P a,      covariance P - P B P
    smoothed w[k] = Q a[k+1],  covariance Q - Q B[k+1] Q

(modified Bryson-Frazier smoother: Bierman, Factorization Methods, 1977, ch. X; of the disturbances
w: de Jong, Biometrika 76, 1989, 663). A is that about the robot's rest, without a ground: what is
stated of uncertainty is exact for a linear system and near it for small motions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.fit.gain import Gain, Modes
from workbench.fit.observer import Innovations

__all__ = ["WINDOW", "Smoothed", "at_points", "smoothed"]

Array = NDArray[np.float64]

WINDOW = 6
"""Samples over which a missing force is averaged: 0.05 s at 120 Hz. Of a single sample the cameras
say next to nothing; of a force of 3 Hz the mean over 0.05 s keeps 96 %."""


@dataclass(frozen=True, eq=False)
class Smoothed:
    """What is to be added to an observer's states before each sample, and what pushed the robot.

    Args:
        filtered: (n, 2 m) what the samples up to each one say [m sqrt(kg), m sqrt(kg)/s].
        change: (n, 2 m) what all samples say [m sqrt(kg), m sqrt(kg)/s].
        covariance: (n, 2 m, 2 m) of the smoothed state [units of `change` squared].
        force: (n, m) missing modal force [N/sqrt(kg)], its mean over `WINDOW` samples around each.
        force_covariance: (n, m, m) of it, the model's own process noise being the prior [N^2/kg].
    """

    filtered: Array
    change: Array
    covariance: Array
    force: Array
    force_covariance: Array


def smoothed(
    run: Innovations, gain: Gain, modes: Modes, process: Array, seconds: float
) -> Smoothed:
    """Smooth an observed run.

    Args:
        run: with n samples.
        gain: it was observed with.
        modes: that gain is of.
        process: (nv,) process noise of each degree of freedom [N sqrt(s), N m sqrt(s)].
        seconds: from one sample to the next.
    """
    missed = ~np.isfinite(run.error)
    error = np.where(missed, 0.0, run.error)
    rates = np.broadcast_to(run.rates, run.slopes.shape)
    transition, kicks, slopes = gain.with_noises(
        modes.transition(seconds),
        modes.kicks(process, seconds),
        np.concatenate([run.slopes, rates], axis=2),
    )
    size = 2 * run.slopes.shape[2]
    slopes[missed] = 0.0
    spread = slopes @ gain.covariance @ slopes.swapaxes(1, 2) + np.diag(gain.noise)
    weighed = np.linalg.solve(spread, error[:, :, None])
    corrected = (slopes.swapaxes(1, 2) @ weighed)[:, :, 0] @ gain.covariance
    state, before, pull, known = _forwards(
        error, slopes, corrected, gain.noise, gain.covariance, transition, kicks
    )
    loops = transition @ (np.eye(len(kicks)) - before @ known)
    adjoint, information = _backwards(pull, known, loops)

    def moved(by: Array) -> Array:
        return state + np.einsum("kab,kb->ka", before, by)

    covariance = before - before @ information @ before
    return Smoothed(
        moved(pull)[:, :size],
        moved(adjoint)[:, :size],
        covariance[:, :size, :size],
        *_missing(adjoint, information, loops, kicks, size, seconds),
    )


def at_points(force: Array, covariance: Array, slopes: Array) -> tuple[Array, Array]:
    """Return the forces at points that explain modal forces best, (n, r) [N], and their covariance.

    Modal forces f of covariance C are J' F for forces F at the points; generalised least squares:
    F = (J C^-1 J')^-1 J C^-1 f, of covariance (J C^-1 J')^-1.

    Args:
        force: (n, m) [N/sqrt(kg)].
        covariance: (n, m, m) of it [N^2/kg].
        slopes: (n, r, m) J, how the points move with the modes' coordinates [kg^-0.5]; r <= m.
    """
    weighed = np.linalg.solve(covariance, slopes.swapaxes(1, 2))  # (n, m, r) C^-1 J'
    found: Array = np.linalg.inv(slopes @ weighed).astype(np.float64)
    return np.einsum("krs,kms,km->kr", found, weighed, force), found


@numba.njit(cache=True, nogil=True)
def _forwards(
    error: Array, slopes: Array, corrected: Array, noise: Array, covariance: Array,
    transition: Array, kicks: Array,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Return d and P before each sample, H' S^-1 r and H' S^-1 H: (n, 2 m), (n, 2 m, 2 m), twice.

    A channel that was not seen has a zero error and zero slopes.
    """
    count, size = corrected.shape
    state, pull = np.zeros((count, size)), np.empty((count, size))
    before, known = np.empty((count, size, size)), np.empty((count, size, size))
    before[0], white, turned = covariance, np.diag(noise), transition.T.copy()
    for k in range(count):
        slope, spread = slopes[k], before[k]
        columns = slope.T.copy()
        weighed = columns @ np.linalg.inv(slope @ spread @ columns + white)
        pull[k], known[k] = weighed @ (error[k] - slope @ state[k]), weighed @ slope
        if k + 1 < count:
            after = spread - spread @ known[k] @ spread
            state[k + 1] = transition @ (state[k] + spread @ pull[k] - corrected[k])
            before[k + 1] = transition @ after @ turned + kicks
    return state, before, pull, known


@numba.njit(cache=True, nogil=True)
def _backwards(pull: Array, known: Array, loops: Array) -> tuple[Array, Array]:
    """Return a, (n, 2 m), and B, (n, 2 m, 2 m), from the last sample to the first."""
    adjoint, information = pull.copy(), known.copy()
    for k in range(len(pull) - 2, -1, -1):
        back = loops[k].T.copy()
        adjoint[k] += back @ adjoint[k + 1]
        information[k] += back @ information[k + 1] @ loops[k]
    return adjoint, information


def _missing(
    adjoint: Array, information: Array, loops: Array, kicks: Array, size: int, seconds: float
) -> tuple[Array, Array]:
    """Return the mean missing force around each sample, (n, m), and its covariance, (n, m, m).

    The kick into sample i is Q a[i]; for i < j the adjoints' covariance is L[i]' ... L[j-1]' B[j]
    (de Jong, eq. 2.15). Beyond the run's ends there is nothing but the prior.
    """
    count, forces = len(adjoint), slice(size // 2, size)
    wide = ((WINDOW // 2,) * 2, (0, 0), (0, 0))
    inner, chain = np.pad(information[1:], wide), np.pad(loops[1:], wide).swapaxes(1, 2)
    rows = np.pad(adjoint[1:], wide[:2])
    total, known = np.zeros_like(adjoint), np.zeros_like(information)
    later = np.zeros_like(known)
    for i in range(WINDOW - 1, -1, -1):
        here = slice(i, i + count)
        total += rows[here]
        known += inner[here] + later + later.swapaxes(1, 2)
        later = chain[i - 1 : i - 1 + count] @ (inner[here] + later) if i else later
    mean = (total @ kicks)[:, forces] / (WINDOW * seconds)
    spread = WINDOW * kicks - kicks @ known @ kicks
    return mean, spread[:, forces, forces] / (WINDOW * seconds) ** 2
