"""The forces within the strip, at its root and at T, and the arrays that the equations share."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.bank.rod_constants import BRANCHES, Constants
from benchmarks.bank.rod_mesh import Mesh

__all__ = ["PITCH", "Work", "bend_forces", "root_forces", "top_forces", "work"]

Array = NDArray[np.float64]

PITCH = 2
"""The coordinate before the bends."""

_STICK_RAD = 1e-4  # of a hinge's bend, after which friction has grown to 63 %
_HINGE_SHARE = 0.5  # most that friction at rest may add to a hinge's stiffness


class Work(NamedTuple):
    """Arrays that the equations write into."""

    jacobian_x: Array  # (p + 1, 3 + n + 1) the last row is T
    jacobian_z: Array
    bias_x: Array  # (p + 1,) acceleration without that of the coordinates
    bias_z: Array
    place_x: Array
    place_z: Array
    start_x: Array  # (3 + n + 1,) sums up to an element
    start_z: Array
    mass: Array  # (3 + n + 1, 3 + n + 1)
    force: Array  # (3 + n + 1,)
    row_x: Array  # (3 + n + 1,) of the rotor
    row_z: Array
    change: Array  # (3 + n + 1,) accelerations


def work(mesh: Mesh) -> Work:
    """Return arrays for a mesh."""
    points, n = len(mesh.mass), mesh.turn.shape[1]
    size = PITCH + 1 + n + 1
    table, row, line = np.zeros((points + 1, size)), np.zeros(points + 1), np.zeros(size)
    return Work(
        table, table.copy(), row, row.copy(), row.copy(), row.copy(), line, line.copy(),
        np.zeros((size, size)), line.copy(), line.copy(), line.copy(), line.copy(),
    )  # fmt: skip


@numba.njit(cache=True)
def bend_forces(
    m: Mesh, k: Constants, q: Array, v: Array, y: Array, dy: Array, w: Work, t: float
) -> None:
    """Subtract what the strip resists with; fill the rates of its friction and its branches."""
    n, size = m.turn.shape[1], len(w.force)
    stiffness = k.hinge_stiffness * (1 - k.warming * t)
    memory = 2 * size + 1
    grip = max(_STICK_RAD, k.hinge_coulomb / (_HINGE_SHARE * k.hinge_stiffness))
    for i in range(len(m.mass)):
        if m.bend_scale[i] == 0.0:
            continue
        bend, rate = 0.0, 0.0
        for a in range(n):
            bend += m.bend[i, a] * q[3 + a]
            rate += m.bend[i, a] * v[3 + a]
        torque = stiffness * m.stiffness[i] * bend + k.hinge_damping * rate
        torque += k.hinge_cubic * bend * bend * bend + k.hinge_quadratic * abs(rate) * rate
        if k.hinge_coulomb > 0.0:  # Dahl: friction with a small spring in front
            held = y[memory + i]
            torque += k.hinge_coulomb * held
            dy[memory + i] = (rate - abs(rate) * held) / grip
        for a in range(n):
            w.force[3 + a] -= m.bend_scale[i] * torque * m.bend[i, a]
    if k.maxwell > 0.0:
        _relax(m, k, q, y, dy, w)


@numba.njit(cache=True)
def _relax(m: Mesh, k: Constants, q: Array, y: Array, dy: Array, w: Work) -> None:
    """Subtract the torques of the Maxwell branches; fill their rates."""
    n = m.turn.shape[1]
    begin = 2 * len(w.force) + 1 + len(m.mass)
    for b in range(BRANCHES):
        relaxing = k.maxwell_time * 10.0 ** (b - 1)
        for a in range(n):
            lag = 0.0
            for c in range(n):
                lag += m.uniform[a, c] * (q[3 + c] - y[begin + b * n + c])
            w.force[3 + a] -= k.maxwell * k.hinge_stiffness * lag
            dy[begin + b * n + a] = (q[3 + a] - y[begin + b * n + a]) / relaxing


@numba.njit(cache=True)
def root_forces(m: Mesh, k: Constants, q: Array, v: Array, y: Array, dy: Array, w: Work) -> None:
    """Subtract what the foot joint resists with; fill the rate of its hysteresis."""
    n, size = m.turn.shape[1], len(w.force)
    bend, rate = 0.0, 0.0
    for a in range(n):
        bend += m.root[a] * q[3 + a]
        rate += m.root[a] * v[3 + a]
    inside = min(max(bend, -k.root_play), k.root_play)
    torque = k.root_stiffness * (bend - inside) + k.root_damping * rate
    if k.hysteresis > 0.0:  # Bouc-Wen, its exponent 2
        at = 2 * size + 1 + len(m.mass) + BRANCHES * n
        full = y[at] / k.hysteresis_yield
        torque += k.hysteresis * y[at]
        dy[at] = rate - 0.5 * (rate + abs(rate) * np.sign(full)) * full * full
    for a in range(n):
        w.force[3 + a] -= torque * m.root[a]


@numba.njit(cache=True)
def top_forces(m: Mesh, k: Constants, v: Array, y: Array, dy: Array, w: Work, first: int) -> None:
    """Add drag, tether, magnet and the loose mass, all of which act at T."""
    top, size, n = len(m.mass), len(w.force), m.turn.shape[1]
    x, z = w.place_x[top], w.place_z[top]
    vx, vz = 0.0, 0.0
    for a in range(size):
        vx += w.jacobian_x[top, a] * v[a]
        vz += w.jacobian_z[top, a] * v[a]
    drag = k.air_drag * np.sqrt(vx * vx + vz * vz)
    fx = -drag * vx - k.tether_stiffness * (x - k.tether_at_x) + k.tether_pull
    fz = -drag * vz
    if k.magnet != 0.0:
        dx, dz = (k.magnet_at_x - x) / k.magnet_reach, (k.magnet_at_z - z) / k.magnet_reach
        pull = k.magnet * np.exp(0.5 - 0.5 * (dx * dx + dz * dz))
        fx += pull * dx
        fz += pull * dz
    if k.loose_mass > 0.0:
        at = 2 * size + 2 + len(m.mass) + BRANCHES * n
        sx, sz = _caged(k, y[at] - x, y[at + 1] - z, float(y[at + 2] - vx), float(y[at + 3] - vz))
        dy[at], dy[at + 1] = y[at + 2], y[at + 3]
        dy[at + 2] = k.gravity_x - sx / k.loose_mass
        dy[at + 3] = k.gravity_z - sz / k.loose_mass
        fx += sx
        fz += sz
    for a in range(first, size):
        w.force[a] += w.jacobian_x[top, a] * fx + w.jacobian_z[top, a] * fz


@numba.njit(cache=True)
def _caged(k: Constants, dx: float, dz: float, vx: float, vz: float) -> tuple[float, float]:
    """Return the force that a loose mass has on its round cage [N]."""
    stiffness, damping = k.loose_mass * 600.0**2, k.loose_mass * 300.0
    far = np.sqrt(dx * dx + dz * dz)
    if far <= k.loose_room:
        return 0.0, 0.0
    force = max(0.0, stiffness * (far - k.loose_room) + damping * (dx * vx + dz * vz) / far)
    return force * dx / far, force * dz / far
