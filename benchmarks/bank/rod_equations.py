"""The rod's equations of motion, compiled: J'mJ q'' = forces, with J along the exact curve.

Coordinates: foot x, z and pitch, n bends of the strip, the rotor against T. A clamped foot keeps
its three; a prescribed rotor moves its column to the right-hand side.

State: coordinates, their rates, the motor's lagged command, then what the effects remember:
friction in the strip (one number a point), Maxwell branches (n each), hysteresis at the root, the
loose mass (place and velocity).
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.bank.rod_constants import Constants
from benchmarks.bank.rod_laws import PITCH, Work, bend_forces, root_forces, top_forces
from benchmarks.bank.rod_mesh import POINTS, Mesh

__all__ = ["conserved", "motor_command", "rates", "static_forces"]

Array = NDArray[np.float64]

_DROOP_S = 0.002  # within which the speed follows the motor's torque


@numba.njit(cache=True)
def _follow(
    m: Mesh, w: Work, e: int, start: tuple[float, float, float, float], tangent_x: Array,
    tangent_z: Array, square: Array,
) -> None:  # fmt: skip
    """Fill places, Jacobians and bias of an element's points; its end goes into the last row."""
    n, h = m.turn.shape[1], m.lengths[e]
    for j in range(POINTS + 1):
        i = POINTS * e + j if j < POINTS else len(m.mass)
        for a in range(n + 3):
            w.jacobian_x[i, a] = w.start_x[a]
            w.jacobian_z[i, a] = w.start_z[a]
        w.place_x[i], w.place_z[i], w.bias_x[i], w.bias_z[i] = start
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
        for j in range(POINTS):
            i = POINTS * e + j
            angle, rate = pitch + k.root_angle + m.angle[i], spin
            for a in range(n):
                angle += m.turn[i, a] * q[3 + a]
                rate += m.turn[i, a] * v[3 + a]
            tangent_x[j], tangent_z[j] = np.cos(angle), -np.sin(angle)
            square[j] = rate * rate
        _follow(m, w, e, (x, z, ax, az), tangent_x, tangent_z, square)
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
    bend_forces(m, k, q, v, y, dy, w, t)
    root_forces(m, k, q, v, y, dy, w)
    top_forces(m, k, v, y, dy, w, first)
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
    bend_forces(m, k, q, v, y, dy, w, 0.0)
    root_forces(m, k, q, v, y, dy, w)
    for a in range(first, size):
        w.force[a] += w.jacobian_x[top, a] * pull
        if a < 3:
            w.force[a] += ground[a]
    if k.magnet != 0.0 or k.loose_mass > 0.0 or k.tether_pull != 0.0:
        top_forces(m, k, v, y, dy, w, first)


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
