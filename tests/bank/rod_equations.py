"""The rod's equations of motion, compiled: J'mJ q'' = forces, with J along the exact curve.

Coordinates: foot x, z and pitch, n bends of the strip, the rotor against T. A clamped foot keeps
its three; a prescribed rotor moves its column to the right-hand side.

State: coordinates, their rates, the motor's lagged command, then what the effects remember:
friction in the strip (one number a point), Maxwell branches (n each), hysteresis at the root, the
loose mass (place and velocity).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tests.bank.rod_constants import BRANCHES, Constants
from tests.bank.rod_mesh import POINTS, Mesh

__all__ = ["PITCH", "Work", "conserved", "motor_command", "rates", "static_forces", "work"]

Array = NDArray[np.float64]

PITCH = 2
"""The coordinate before the bends."""

_DROOP_S = 0.002  # within which the speed follows the motor's torque
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
def _curve(m: Mesh, k: Constants, q: Array, v: Array, w: Work) -> None:
    """Fill places, Jacobians and bias accelerations of all points and of T."""
    n = m.turn.shape[1]
    pitch, spin = q[PITCH], v[PITCH]
    c, s = np.cos(pitch), np.sin(pitch)
    x, z = q[0] + k.beam_root * c, q[1] - k.beam_root * s
    ax, az = -spin * spin * k.beam_root * c, spin * spin * k.beam_root * s
    w.start_x[:] = 0.0
    w.start_z[:] = 0.0
    w.start_x[0] = 1.0
    w.start_z[1] = 1.0
    w.start_x[PITCH] = -k.beam_root * s
    w.start_z[PITCH] = -k.beam_root * c
    tangent_x, tangent_z = np.empty(POINTS), np.empty(POINTS)
    square = np.empty(POINTS)
    for e in range(len(m.lengths)):
        h = m.lengths[e]
        for j in range(POINTS):
            i = POINTS * e + j
            angle, rate = pitch + k.root_angle + m.angle[i], spin
            for a in range(n):
                angle += m.turn[i, a] * q[3 + a]
                rate += m.turn[i, a] * v[3 + a]
            tangent_x[j], tangent_z[j] = np.cos(angle), -np.sin(angle)
            square[j] = rate * rate
        for j in range(POINTS + 1):  # the last one ends the element
            i = POINTS * e + j if j < POINTS else len(m.mass)
            for a in range(n + 3):
                w.jacobian_x[i, a] = w.start_x[a]
                w.jacobian_z[i, a] = w.start_z[a]
            w.place_x[i], w.place_z[i], w.bias_x[i], w.bias_z[i] = x, z, ax, az
            for b in range(POINTS):
                share = h * (m.part[j, b] if j < POINTS else m.whole[b])
                tx, tz = share * tangent_x[b], share * tangent_z[b]
                w.place_x[i] += tx
                w.place_z[i] += tz
                w.bias_x[i] -= square[b] * tx
                w.bias_z[i] -= square[b] * tz
                w.jacobian_x[i, PITCH] += tz  # the normal is (tz, -tx)
                w.jacobian_z[i, PITCH] -= tx
                for a in range(n):
                    turn = m.turn[POINTS * e + b, a]
                    w.jacobian_x[i, 3 + a] += turn * tz
                    w.jacobian_z[i, 3 + a] -= turn * tx
        i = len(m.mass)
        x, z, ax, az = w.place_x[i], w.place_z[i], w.bias_x[i], w.bias_z[i]
        for a in range(n + 3):
            w.start_x[a] = w.jacobian_x[i, a]
            w.start_z[a] = w.jacobian_z[i, a]


@numba.njit(cache=True)
def _add_mass(
    w: Work, k: Constants, mass: float, jx: Array, jz: Array, ax: float, az: float, first: int
) -> None:
    """Add a point mass to the mass matrix, its weight and bias to the forces."""
    size = len(w.force)
    gx, gz = mass * (k.gravity_x - ax), mass * (k.gravity_z - az)
    for a in range(first, size):
        mx, mz = mass * jx[a], mass * jz[a]
        w.force[a] += jx[a] * gx + jz[a] * gz
        for b in range(a, size):
            w.mass[a, b] += mx * jx[b] + mz * jz[b]


@numba.njit(cache=True)
def _add_turning(m: Mesh, w: Work, inertia: float, rotor: float, first: int) -> None:
    """Add a moment of inertia that turns with T, and with the rotor if that is 1."""
    n = m.turn.shape[1]
    size, top = len(w.force), len(m.mass)
    row = w.change  # not yet in use
    row[:] = 0.0
    row[PITCH] = 1.0
    for a in range(n):
        row[3 + a] = m.turn[top, a]
    row[size - 1] = rotor
    for a in range(first, size):
        for b in range(a, size):
            w.mass[a, b] += inertia * row[a] * row[b]


@numba.njit(cache=True)
def _tip(m: Mesh, k: Constants, q: Array) -> float:
    angle = q[PITCH] + k.root_angle + m.angle[len(m.mass)]
    for a in range(m.turn.shape[1]):
        angle += m.turn[len(m.mass), a] * q[3 + a]
    return angle


@numba.njit(cache=True)
def _tip_rate(m: Mesh, v: Array) -> float:
    rate = v[PITCH]
    for a in range(m.turn.shape[1]):
        rate += m.turn[len(m.mass), a] * v[3 + a]
    return rate


@numba.njit(cache=True)
def _inertia_and_weight(m: Mesh, k: Constants, q: Array, v: Array, w: Work, first: int) -> None:
    n, top, size = m.turn.shape[1], len(m.mass), len(w.force)
    w.mass[:] = 0.0
    w.force[:] = 0.0
    for i in range(top):
        _add_mass(
            w, k, m.mass[i], w.jacobian_x[i], w.jacobian_z[i], w.bias_x[i], w.bias_z[i], first
        )
    jx, jz, ax, az = w.jacobian_x[top], w.jacobian_z[top], w.bias_x[top], w.bias_z[top]
    _add_mass(w, k, k.top_mass, jx, jz, ax, az, first)
    _add_turning(m, w, k.top_inertia, 0.0, first)
    spoke, spin = _tip(m, k, q) + q[size - 1], _tip_rate(m, v) + v[size - 1]
    lx, lz = k.rotor_lever * np.cos(spoke), -k.rotor_lever * np.sin(spoke)
    for a in range(size):
        turn = 0.0
        if a == PITCH or a == size - 1:
            turn = 1.0
        elif 3 <= a < 3 + n:
            turn = m.turn[top, a - 3]
        w.row_x[a], w.row_z[a] = jx[a] + turn * lz, jz[a] - turn * lx
    ax, az = ax - spin * spin * lx, az - spin * spin * lz
    _add_mass(w, k, k.rotor_mass, w.row_x, w.row_z, ax, az, first)
    _add_turning(m, w, k.rotor_inertia, 1.0, first)
    if first == 0:
        w.change[:] = 0.0
        c, s = np.cos(q[PITCH]), np.sin(q[PITCH])
        w.row_x[:] = 0.0
        w.row_z[:] = 0.0
        w.row_x[0], w.row_z[1] = 1.0, 1.0
        w.row_x[PITCH], w.row_z[PITCH] = -k.foot_cg * s, -k.foot_cg * c
        square = v[PITCH] * v[PITCH] * k.foot_cg
        _add_mass(w, k, k.foot_mass, w.row_x, w.row_z, -square * c, square * s, first)
        w.mass[PITCH, PITCH] += k.foot_inertia


@numba.njit(cache=True)
def _bend_forces(
    m: Mesh, k: Constants, q: Array, v: Array, y: Array, dy: Array, w: Work, t: float
) -> None:
    """Subtract what the strip resists with; fill the rates of its friction."""
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
        begin = memory + len(m.mass)
        for b in range(BRANCHES):
            relaxing = k.maxwell_time * 10.0 ** (b - 1)
            for a in range(n):
                lag = 0.0
                for c in range(n):
                    lag += m.uniform[a, c] * (q[3 + c] - y[begin + b * n + c])
                w.force[3 + a] -= k.maxwell * k.hinge_stiffness * lag
                dy[begin + b * n + a] = (q[3 + a] - y[begin + b * n + a]) / relaxing


@numba.njit(cache=True)
def _root_forces(m: Mesh, k: Constants, q: Array, v: Array, y: Array, dy: Array, w: Work) -> None:
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
def _top_forces(m: Mesh, k: Constants, v: Array, y: Array, dy: Array, w: Work, first: int) -> None:
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
        sx, sz = _caged(k, y[at] - x, y[at + 1] - z, y[at + 2] - vx, y[at + 3] - vz)
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


@numba.njit(cache=True)
def motor_command(k: Constants, times: Array, speeds: Array, t: float) -> float:
    """Return the speed that the motor strives for [rad/s]: the last step, with its errors."""
    at = np.searchsorted(times, t, side="right") - 1
    if at < 0 or speeds[at] == 0.0:
        return 0.0
    return (speeds[at] * (1 + k.speed_scale) + k.speed_offset) * (1 + k.speed_drift * t)


@numba.njit(cache=True)
def _rotor_row(
    m: Mesh, k: Constants, q: Array, v: Array, y: Array, dy: Array, w: Work, strives: float
) -> float:
    """Fill the motor's lag; return the rotor's acceleration before droop [rad/s^2]."""
    size = len(w.force)
    speed = y[2 * size]
    slope = (strives - speed) / k.motor_lag
    dy[2 * size] = slope
    spoke, spin = _tip(m, k, q) + q[size - 1], _tip_rate(m, v) + v[size - 1]
    c, s = np.cos(spoke), np.sin(spoke)
    c2, s2 = c * c - s * s, 2 * c * s
    factor = 1 + k.ripple_cos_1 * c + k.ripple_sin_1 * s + k.ripple_cos_2 * c2 + k.ripple_sin_2 * s2
    grows = (
        k.ripple_sin_1 * c - k.ripple_cos_1 * s + 2 * (k.ripple_sin_2 * c2 - k.ripple_cos_2 * s2)
    )
    change = slope * factor + speed * grows * spin
    if k.gear_error != 0.0:
        phase = k.gear_turns * q[size - 1]
        factor += k.gear_error * k.gear_turns * np.cos(phase)
        change += slope * k.gear_error * k.gear_turns * np.cos(phase)
        change -= speed * k.gear_error * k.gear_turns**2 * np.sin(phase) * v[size - 1]
    if k.motor_droop > 0.0:
        change += (speed * factor - v[size - 1]) / _DROOP_S
    return change


@numba.njit(cache=True)
def _solve(w: Work, first: int, rotor: float, droop: float) -> None:
    """Solve for the accelerations by Cholesky in place; a rotor without droop is prescribed."""
    size = len(w.force)
    last = size if droop > 0.0 else size - 1
    for a in range(size):
        w.change[a] = 0.0
    if droop > 0.0:
        inertia = _DROOP_S / droop
        w.mass[size - 1, size - 1] += inertia
        w.force[size - 1] += inertia * rotor
    else:
        w.change[size - 1] = rotor
        for a in range(first, last):
            w.force[a] -= w.mass[a, size - 1] * rotor
    for a in range(first, last):  # upper triangle, row a holds U[a, a:]
        for b in range(a, last):
            total = w.mass[a, b]
            for c in range(first, a):
                total -= w.mass[c, a] * w.mass[c, b]
            w.mass[a, b] = np.sqrt(total) if a == b else total / w.mass[a, a]
    for a in range(first, last):
        total = w.force[a]
        for c in range(first, a):
            total -= w.mass[c, a] * w.change[c]
        w.change[a] = total / w.mass[a, a]
    for a in range(last - 1, first - 1, -1):
        total = w.change[a]
        for c in range(a + 1, last):
            total -= w.mass[a, c] * w.change[c]
        w.change[a] = total / w.mass[a, a]


@numba.njit(cache=True)
def rates(
    m: Mesh, k: Constants, y: Array, dy: Array, w: Work, ground: Array,
    strives: float, t: float, first: int,
) -> None:  # fmt: skip
    """Fill the rates of a state.

    Args:
        m: the strip.
        k: the robot.
        y: (s,) state.
        dy: (s,) its rates, written.
        w: arrays to work in.
        ground: (3,) force on the foot's coordinates x, z and pitch.
        strives: for which speed the motor strives [rad/s].
        t: time [s].
        first: moving coordinate, 3 for a clamped foot and 0 for a free one.
    """
    size = len(w.force)
    q, v = y[:size], y[size : 2 * size]
    dy[:] = 0.0
    _curve(m, k, q, v, w)
    _inertia_and_weight(m, k, q, v, w, first)
    _bend_forces(m, k, q, v, y, dy, w, t)
    _root_forces(m, k, q, v, y, dy, w)
    _top_forces(m, k, v, y, dy, w, first)
    for a in range(first, 3):
        w.force[a] += ground[a]
    rotor = _rotor_row(m, k, q, v, y, dy, w, strives)
    _solve(w, first, rotor, k.motor_droop)
    for a in range(first, size):
        dy[a], dy[size + a] = v[a], w.change[a]


@numba.njit(cache=True)
def static_forces(
    m: Mesh, k: Constants, y: Array, dy: Array, w: Work, ground: Array, pull: float, first: int
) -> None:
    """Leave in `w.force` the forces on a motionless state, T pulled forward [N]."""
    size, top = len(w.force), len(m.mass)
    q, v = y[:size], y[size : 2 * size]
    _curve(m, k, q, v, w)
    _inertia_and_weight(m, k, q, v, w, first)
    _bend_forces(m, k, q, v, y, dy, w, 0.0)
    _root_forces(m, k, q, v, y, dy, w)
    for a in range(first, size):
        w.force[a] += w.jacobian_x[top, a] * pull
        if a < 3:
            w.force[a] += ground[a]
    if k.magnet != 0.0 or k.loose_mass > 0.0 or k.tether_pull != 0.0:
        _top_forces(m, k, v, y, dy, w, first)


@numba.njit(cache=True)
def conserved(m: Mesh, k: Constants, y: Array, w: Work, first: int) -> tuple[float, float]:
    """Return potential and kinetic energy of strip, foot, top and rotor [J], base laws only."""
    size, top, n = len(w.force), len(m.mass), m.turn.shape[1]
    q, v = y[:size], y[size : 2 * size]
    _curve(m, k, q, v, w)
    _inertia_and_weight(m, k, q, v, w, first)
    kinetic = 0.0
    for a in range(first, size):
        kinetic += 0.5 * w.mass[a, a] * v[a] * v[a]
        for b in range(a + 1, size):
            kinetic += w.mass[a, b] * v[a] * v[b]
    spoke = _tip(m, k, q) + q[size - 1]
    high = w.place_z[top] - k.rotor_lever * np.sin(spoke)
    potential = -k.gravity_z * (k.top_mass * w.place_z[top] + k.rotor_mass * high)
    bend = 0.0
    for a in range(n):
        bend += m.root[a] * q[3 + a]
    potential += 0.5 * k.root_stiffness * bend * bend - k.gravity_z * k.foot_mass * q[1]
    for i in range(top):
        bend = 0.0
        for a in range(n):
            bend += m.bend[i, a] * q[3 + a]
        potential += 0.5 * k.hinge_stiffness * m.bend_scale[i] * bend * bend
        potential -= k.gravity_z * m.mass[i] * w.place_z[i]
    return potential, kinetic
