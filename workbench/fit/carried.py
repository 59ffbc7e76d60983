"""Derivatives carried from one process noise to another, without a simulation of either.

Two observers with gains K1 and K2 follow one run by one model. What a parameter does to their
states differs by d, in the coordinates z of the modes; what it does to the model is the same in
both, and cancels. With E = de/dtheta and H = dy/dz,

    E2[k] = E1[k] - H d[k],   d[k+1] = A (d[k] + K2 E2[k] - K1 E1[k]),   d[0] = 0,   K = P H' S^-1

A[k] = dz[k+1]/dz[k] is that of the motion itself, by differences from each sample to the next: a
rotor that turns makes it another from sample to sample, and over the seconds that a weak gain
remembers that of the rest is out of phase. It depends on the motion alone, which was seen, and so
it serves all fits of a run.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.fit.estimator import Estimator
from workbench.fit.gain import Gain
from workbench.fit.observer import Innovations, Job, Together
from workbench.sim import mass_matrix

__all__ = ["Transitions", "carried", "transitions_of"]

Array = NDArray[np.float64]

_AT_ONCE = 8  # samples
_ANGLE, _RATE = 1e-5, 1e-4  # length of a difference [rad, rad/s]


def transitions_of(estimator: Estimator, x: Array) -> tuple[Array, ...]:
    """Return A of each run, (n, 2 m, 2 m) [unit of z by that of z], from each sample to the next.

    Args:
        estimator: of runs in which no foot lands, driven by integrals of their controls.
        x: (p,) the minimiser's numbers of the motion [1].
    """
    jobs = [estimator.job(k, x, coarse=True) for k in range(len(estimator.modes))]
    return tuple(map(_run_transitions, jobs, estimator.innovations(x, keep=True)))


def _run_transitions(job: Job, run: Innovations) -> Array:
    """Return A of a run, (n, 2 m, 2 m), by differences of each of z from where it was."""
    model, basis = job.model, job.gain.basis
    samples, modes = len(run.qpos), basis.shape[1]
    data = mujoco.MjData(model)
    data.qpos[:] = run.qpos[0]
    mujoco.mj_forward(model, data)
    mass = mass_matrix(model, data)
    coordinates = np.linalg.solve(basis.T @ mass @ basis, basis.T @ mass)
    lengths = np.outer([_ANGLE, _RATE], 1 / np.linalg.norm(basis, axis=0)).ravel()
    moves = np.zeros((2, 1 + 2 * modes, len(basis)))
    moves[0, 1 : 1 + modes] = (basis * lengths[:modes]).T
    moves[1, 1 + modes :] = (basis * lengths[modes:]).T
    count = moves.shape[1]
    lanes = Together([job] * (_AT_ONCE * count))
    qpos, qvel, qacc = (part.reshape(_AT_ONCE, count, -1) for part in lanes.state)
    held = model.actuator_actadr >= 0
    act = lanes.batch.bind("act").reshape(_AT_ONCE, count, -1)
    at = model.jnt_qposadr[model.actuator_trnid[held, 0]]
    found = np.empty((samples, 2 * modes, 2 * modes))
    for begin in range(0, samples, _AT_ONCE):
        rows = np.minimum(np.arange(begin, begin + _AT_ONCE), samples - 1)
        qpos[:] = run.qpos[rows, None] + moves[0]
        qvel[:] = run.qvel[rows, None] + moves[1]
        qacc[:] = run.qacc[rows, None]
        act[:, :, model.actuator_actadr[held]] = run.qpos[rows, None][:, :, at]
        lanes.step(np.repeat(job.control[rows], count, axis=0))
        moved = [(part[:, 1:] - part[:, :1]) @ coordinates.T for part in (qpos, qvel)]
        change = np.concatenate(moved, axis=2) / lengths[:, None]
        found[rows] = change.swapaxes(1, 2)
    return found


class _Correction(NamedTuple):
    """How each sample corrects.

    Args:
        factor: (n, c, c) L of S = L L' [unit of the channel].
        inverse: (n, c, c) of it.
        gain: (n, w, c) K [unit of z by that of the channel].
    """

    factor: Array
    inverse: Array
    gain: Array

    @classmethod
    def of(cls, gain: Gain, slopes: Array, missed: NDArray[np.bool_]) -> _Correction:
        """Return the correction by a gain.

        Args:
            gain: of the run.
            slopes: (n, c, w) H, zero where nothing was seen [unit of the channel by that of z].
            missed: (n, c) where nothing was seen.
        """
        spread = slopes @ gain.covariance
        noise = np.where(missed, 1.0, gain.noise)
        square = spread @ slopes.swapaxes(1, 2) + noise[:, :, None] * np.eye(noise.shape[1])
        factor = np.asarray(np.linalg.cholesky(square), dtype=np.float64)
        inverse = np.asarray(np.linalg.inv(factor), dtype=np.float64)
        weighted = spread.swapaxes(1, 2) @ inverse.swapaxes(1, 2) @ inverse
        return cls(factor, inverse, weighted)


class Transitions:
    """How the motion of runs goes from sample to sample, found once for each kind of machine."""

    def __init__(self) -> None:
        self._along: dict[tuple[tuple[int, ...], ...], tuple[Array, ...]] = {}

    def carried(
        self, jacobian: Array, x: Array, before: Estimator, after: Estimator
    ) -> tuple[Array, bool]:
        """Return derivatives of the residuals, (m, p) [1], and whether they are those after.

        They are those before where differences are long, and where this leads out of all bounds.

        Args:
            jacobian: (m, p) of the residuals before [1].
            x: (p,) the minimiser's numbers that they were taken at, or near [1].
            before: estimator that they are of.
            after: of the same runs and parameters with another process noise.
        """
        if not before.short:
            return jacobian, False
        machine = tuple(one.basis.shape for one in before.modes)
        if machine not in self._along:
            self._along[machine] = transitions_of(before, x)
        found, along = before.innovations(x, keep=True), self._along[machine]
        with np.errstate(over="ignore", invalid="ignore"):
            moved = carried(jacobian, before, after, found, along)
        known = bool(np.isfinite(moved).all())
        return (moved if known else jacobian), known


def carried(
    jacobian: Array,
    before: Estimator,
    after: Estimator,
    found: Sequence[Innovations],
    along: Sequence[Array],
) -> Array:
    """Return the derivatives of the residuals at another process noise, (m, p) [1].

    Args:
        jacobian: (m, p) of the residuals before [1].
        before: estimator that they are of.
        after: of the same runs and parameters with another process noise.
        found: innovations of each run where the derivatives were taken, or near, of either.
        along: A of each run, of `transitions_of`.
    """
    edges, moved = before.edges, jacobian.copy()
    for k, (one, own) in enumerate(zip(found, along, strict=True)):
        gains = before.gains[k], after.gains[k]
        if np.array_equal(gains[0].covariance, gains[1].covariance):
            continue
        rows, (samples, channels) = slice(edges[k], edges[k + 1]), one.error.shape
        chosen = np.flatnonzero(jacobian[rows].any(axis=0))
        missed = ~np.isfinite(one.error)
        rates = np.broadcast_to(one.rates, one.slopes.shape)
        of_modes = np.concatenate([one.slopes, rates], axis=2)
        forward, _, slopes = gains[0].with_noises(own, own, of_modes)
        slopes = np.where(missed[:, :, None], 0.0, slopes)
        first, second = (_Correction.of(gain, slopes, missed) for gain in gains)
        columns = jacobian[rows][:, chosen].reshape(samples, channels, -1)
        errors = first.factor @ columns
        kept = forward @ (np.eye(len(forward[0])) - second.gain @ slopes)
        pushed = forward @ (second.gain - first.gain) @ errors
        apart = np.zeros_like(pushed)
        for sample in range(1, samples):
            apart[sample] = kept[sample - 1] @ apart[sample - 1] + pushed[sample - 1]
        other = second.inverse @ (errors - slopes @ apart)
        moved[rows, chosen] = other.reshape(samples * channels, -1)
    return moved
