"""The correction of one sample, compiled: from what was seen to where the robot is.

For every simulation, with H = dy/dz at its present pose, z = (c, c') the coordinates of the lowest
modes (q = basis c) and P their covariance before the sample:

    e = y - h(q, q') - v,   S = H P H' + R,   z += P H' S^-1 e

v is what the noise before says of this sample's, where it has a memory; it is corrected with z.
A sample that was not seen in a channel (NaN) leaves that channel out, and so does one that is
farther off than a gate: a glitch would kick the state, and every sample after it would be off as
well. What is off for longer than a glitch lasts is let in. Written in scalars: an array made here
would be an allocation in every sample.

`track_chains` does so from the first sample of a run to the last, stepping in between.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim import compiled, step_chains

__all__ = ["LONGEST", "correct", "predicted", "track_chains", "translations"]

Array = NDArray[np.float64]

LONGEST = 3
"""Samples of a glitch; what lasts longer is not one."""


@numba.njit(cache=True, nogil=True)
def predicted(
    places: Array, axes: Array, bodies: NDArray[np.int64], offsets: Array, points: Array
) -> None:
    """Write the world's places of points on bodies.

    Args:
        places: (s, nbody, 3) xpos [m].
        axes: (s, nbody, 9) xmat [1].
        bodies: (p,) of the points.
        offsets: (s, p, 3) in the bodies' frames [m].
        points: (s, p, 3) written [m].
    """
    for s in range(points.shape[0]):
        for p in range(points.shape[1]):
            b = bodies[p]
            for i in range(3):
                total = places[s, b, i]
                for j in range(3):
                    total += axes[s, b, 3 * i + j] * offsets[s, p, j]
                points[s, p, i] = total


@numba.njit(cache=True, nogil=True)
def translations(
    points: Array, bodies: NDArray[np.int64], anchors: Array, axes: Array,
    joints: NDArray[np.int64], slides: NDArray[np.bool_], moving: NDArray[np.bool_],
    jacobian: Array,
) -> None:  # fmt: skip
    """Write the derivatives of points by hinges and slides.

    Args:
        points: (s, p, 3) places [m].
        bodies: (p,) of the points.
        anchors: (s, njnt, 3) xanchor [m].
        axes: (s, njnt, 3) xaxis [1].
        joints: (nv,) of the degrees of freedom.
        slides: (nv,) which of them slide.
        moving: (nbody, nv) which move a body.
        jacobian: (s, 3 p, nv) written [m/m, m/rad].
    """
    for s in range(points.shape[0]):
        for p in range(points.shape[1]):
            for d in range(jacobian.shape[2]):
                j = joints[d]
                x, y, z = axes[s, j, 0], axes[s, j, 1], axes[s, j, 2]
                if not moving[bodies[p], d]:
                    x = y = z = 0.0
                elif not slides[d]:
                    a = points[s, p, 0] - anchors[s, j, 0]
                    b = points[s, p, 1] - anchors[s, j, 1]
                    c = points[s, p, 2] - anchors[s, j, 2]
                    x, y, z = y * c - z * b, z * a - x * c, x * b - y * a
                jacobian[s, 3 * p, d] = x
                jacobian[s, 3 * p + 1, d] = y
                jacobian[s, 3 * p + 2, d] = z


@numba.njit(cache=True, nogil=True)
def correct(
    seen: Array, gate: Array, streak: NDArray[np.int64], points: Array, jacobian: Array,
    mix: Array, pick: Array, pick_rate: Array, bias: Array, delay: Array,
    basis: Array, covariance: Array, noise: Array, memory: Array, coloured: Array,
    follow: NDArray[np.int64],
    qpos: Array, qvel: Array, userdata: Array,
    innovation: Array, white: Array, information: Array, slopes: Array,
) -> None:  # fmt: skip
    """Correct all simulations by one sample.

    Args:
        seen: (s, c) measured; NaN where not seen [unit of the channel].
        gate: (s, c) innovation beyond which a sample is left out, as long as a glitch may last
            [unit of the channel].
        streak: (s, c) samples in a row beyond the gate so far, counted on.
        points: (s, p, 3) predicted places [m].
        jacobian: (s, 3 p, nv) of the points [m/m, m/rad].
        mix: (s, c, 3 p) from points to channels [unit of the channel by m].
        pick: (s, c, nq) from joints to channels [unit of the channel by that of qpos].
        pick_rate: (s, c, nv) from the joints' rates to channels [unit of the channel by that of
            qvel].
        bias: (s, c) added [unit of the channel].
        delay: (s, c) by which the channels show places late [s].
        basis: (s, nv, m) modes [kg^-0.5].
        covariance: (s, 2 m + v, 2 m + v) of z, and of v, before the sample [their units squared]; v
            = c where noise has a memory, or 0.
        noise: (s, c) variance of what is white of the noise [unit of the channel squared].
        memory: (s, c) correlation of a channel's noise with that of the sample before [1].
        coloured: (s, c) noise with a memory, expected, corrected and taken on in place [unit of the
            channel].
        follow: (k,) entries of userdata that move with the first degree of freedom.
        qpos: (s, nq) corrected in place [m, rad].
        qvel: (s, nv) corrected in place [m/s, rad/s].
        userdata: (s, nuserdata) corrected in place [SI].
        innovation: (s, c) written: measured less predicted, NaN where not seen or left out [unit of
            the channel].
        white: (s, c) written: L^-1 e with L L' = S, zero where not seen [1].
        information: (s,) written: log det S of the channels seen [1].
        slopes: (s, c, m) written: H of the coordinates [unit of the channel by m sqrt(kg)]; that of
            their rates is pick_rate basis less delay times it.
    """
    count, channels = seen.shape
    modes = basis.shape[2]
    width, dofs, spots = covariance.shape[1], basis.shape[1], mix.shape[2]
    noisy = width > 2 * modes
    factor, spread = np.empty((channels, channels)), np.empty((channels, width))
    solved, change = np.empty(channels), np.empty(width)
    row, rates = np.empty(dofs), np.empty((channels, modes))
    for s in range(count):
        for c in range(channels):
            value = bias[s, c]
            for i in range(spots):
                value += mix[s, c, i] * points[s, i // 3, i % 3]
            for i in range(qpos.shape[1]):
                value += pick[s, c, i] * qpos[s, i]
            for d in range(dofs):
                value += pick_rate[s, c, d] * qvel[s, d]
            for d in range(dofs):
                row[d] = pick[s, c, d]
            for i in range(spots):
                weight = mix[s, c, i]
                if weight != 0.0:
                    for d in range(dofs):
                        row[d] += weight * jacobian[s, i, d]
            for d in range(dofs):
                value -= delay[s, c] * row[d] * qvel[s, d]
            innovation[s, c] = seen[s, c] - value - coloured[s, c]
            if abs(innovation[s, c]) > gate[s, c]:
                streak[s, c] += 1
                if streak[s, c] <= LONGEST:
                    innovation[s, c] = np.nan
            elif not np.isnan(innovation[s, c]):
                streak[s, c] = 0
            for m in range(modes):
                total, rate = 0.0, 0.0
                for d in range(dofs):
                    total += row[d] * basis[s, d, m]
                    rate += pick_rate[s, c, d] * basis[s, d, m]
                slopes[s, c, m], rates[c, m] = total, rate - delay[s, c] * total
        for c in range(channels):
            for a in range(width):
                total = 0.0
                for m in range(modes):
                    total += slopes[s, c, m] * covariance[s, m, a]
                    total += rates[c, m] * covariance[s, modes + m, a]
                if noisy:
                    total += covariance[s, 2 * modes + c, a]
                spread[c, a] = total
        information[s] = 0.0
        for c in range(channels):  # Cholesky's factor of S, and L^-1 e on the way
            missing = np.isnan(innovation[s, c])
            for b in range(c + 1):
                total = noise[s, c] if b == c else 0.0
                if missing or np.isnan(innovation[s, b]):
                    factor[c, b] = 1.0 if b == c else 0.0
                    continue
                for m in range(modes):
                    total += spread[c, m] * slopes[s, b, m]
                    total += spread[c, modes + m] * rates[b, m]
                if noisy:
                    total += spread[c, 2 * modes + b]
                for i in range(b):
                    total -= factor[c, i] * factor[b, i]
                factor[c, b] = np.sqrt(total) if b == c else total / factor[b, b]
            if missing:
                white[s, c] = 0.0
                continue
            total = innovation[s, c]
            for b in range(c):
                total -= factor[c, b] * white[s, b]
            white[s, c] = total / factor[c, c]
            information[s] += 2 * np.log(factor[c, c])
        for c in range(channels - 1, -1, -1):
            total = white[s, c]
            for b in range(c + 1, channels):
                total -= factor[b, c] * solved[b]
            solved[c] = total / factor[c, c]
            if np.isnan(innovation[s, c]):
                solved[c] = 0.0
        for a in range(width):
            total = 0.0
            for c in range(channels):
                total += spread[c, a] * solved[c]
            change[a] = total
        if noisy:
            for c in range(channels):
                coloured[s, c] = memory[s, c] * (coloured[s, c] + change[2 * modes + c])
        moved = 0.0
        for d in range(dofs):
            place, rate = 0.0, 0.0
            for m in range(modes):
                place += basis[s, d, m] * change[m]
                rate += basis[s, d, m] * change[modes + m]
            qpos[s, d] += place
            qvel[s, d] += rate
            if d == 0:
                moved = place
        for i in follow:
            userdata[s, i] += moved


def _track_chains(
    chains: Any, command: Array, control: Array, seen: Array, sane: NDArray[np.int64],
    broken: NDArray[np.bool_], places: Any, slopes_of: Any, gates: Any, view: Any, state: Any,
    found: Any, kept: Any,
) -> None:  # fmt: skip
    """Step chains from sample to sample to their end, and correct them by each.

    Args:
        chains: arguments of `step_chains`.
        command: (s, nu) ctrl, written [unit of the actuator].
        control: (s, n, nu) from each sample to the next [unit of the actuator].
        seen: (s, n, c) of `correct`, as what follows [unit of the channel].
        sane: (s,) samples before the numbers blew up, written.
        broken: (s,) of `step_chains`.
        places: of `predicted`.
        slopes_of: of `translations`, from the bodies to the Jacobian.
        gates: gate and streak.
        view: mix to coloured, then follow.
        state: qpos, qvel, acceleration of the step before and userdata.
        found: innovation to slopes, of all samples, (n, s, ...).
        kept: of the first three before each correction, (n, s, nq) and twice (n, s, nv), written;
            of no samples where they are not wanted.
    """
    points, jacobian = places[-1], slopes_of[-1]
    (gate, streak), (qpos, qvel, qacc, userdata) = gates, state
    mix, pick, pick_rate, bias, delay, basis, covariance, noise, memory, coloured, follow = view
    innovation, white, information, slopes = found
    for k in range(seen.shape[1]):
        if k > 0:
            broken[:] = False  # corrected, it may go on
            command[:] = control[:, k - 1]
            step_chains(*chains)
            for s in range(len(sane)):
                if broken[s]:
                    sane[s] = min(sane[s], k)
        if len(kept[0]):
            kept[0][k] = qpos
            kept[1][k] = qvel
            kept[2][k] = qacc
        predicted(*places)
        translations(points, *slopes_of)
        correct(
            seen[:, k], gate, streak, points, jacobian, mix, pick, pick_rate, bias, delay,
            basis, covariance, noise, memory, coloured, follow, qpos, qvel, userdata,
            innovation[k], white[k], information[k], slopes[k],
        )  # fmt: skip


track_chains: Callable[..., None] = compiled(_track_chains)
