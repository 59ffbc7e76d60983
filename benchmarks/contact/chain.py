"""The planar robot: foot, beam of hinged increments, T and rotor, in absolute angles.

Every part hangs on the one before by a distance along its own line, so that the mass matrix is
A_ij cos(phi_i - phi_j) with constant A, and springs act on differences of angles. Coordinates are
the foot's x and z [m] and the angles about +y of foot, increments and rotor [rad].
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim import Robot

__all__ = ["Chain", "chain_of", "factor", "forces", "mass_matrix", "solve", "state_of"]

Array = NDArray[np.float64]


class Chain(NamedTuple):
    """Constants of a robot with n angles: foot, n - 2 increments, rotor.

    Args:
        total: mass [kg].
        first: (n,) sum of mass times lever along each angle's line [kg m].
        second: (n, n) sum of mass times both levers, moments of inertia on the diagonal [kg m^2].
        stiffness: (n - 2,) of the hinge before each increment [N m/rad].
        damping: (n - 2,) of the same [N m s/rad].
        rest: (n - 2,) angle of the same without load [rad].
        servo: stiffness [N m/rad] and damping [N m s/rad] between rotor and its commanded angle.
        gravity: downward [m/s^2].
        half: half the foot's length [m].
        normal: stiffness [N/m] and damping [N s/m] of the ground under one edge, two corners.
        friction: coefficients of sliding and of sticking, threshold speed [m/s].
    """

    total: float
    first: Array
    second: Array
    stiffness: Array
    damping: Array
    rest: Array
    servo: tuple[float, float]
    gravity: float
    half: float
    normal: tuple[float, float]
    friction: tuple[float, float, float]


def chain_of(robot: Robot, servo: tuple[float, float]) -> Chain:
    """Return the chain of a robot whose angles are those of its free strip."""
    v, hinges = robot.values, robot.hinges
    step, count = robot.length / robot.increments, robot.increments + 2
    beam = v["beam_mass"] / robot.increments
    point, arm, radius = v["rotor_mass"], v["rotor_arm_mass"], v["rotor_radius"]
    centre = (point * radius + arm * radius / 2) / (point + arm)
    # mass, moment about the own centre, whose angle, levers along each angle
    parts: list[tuple[float, float, int, Array]] = []
    lever = np.zeros(count)
    parts.append((v["foot_mass"], v["foot_mass"] / 12 * v["foot_length"] ** 2, 0, lever.copy()))
    lever[0] = v["beam_root"]
    for k in range(1, count - 1):
        lever[k] = step / 2
        parts.append((beam, beam / 12 * step**2, k, lever.copy()))
        lever[k] = step
    parts.append((v["top_mass"], v["top_mass"] / 12 * step**2, count - 2, lever.copy()))
    lever[-1] = centre
    spread = point * (radius - centre) ** 2
    spread += arm * (radius**2 / 12 + (radius / 2 - centre) ** 2)
    parts.append((point + arm, spread, count - 1, lever.copy()))
    second = sum(m * np.outer(r, r) for m, _, _, r in parts) + np.zeros((count, count))
    for _, moment, own, _ in parts:
        second[own, own] += moment
    return Chain(
        total=float(sum(m for m, *_ in parts)),
        first=np.asarray(sum(m * r for m, _, _, r in parts), dtype=float),
        second=second,
        stiffness=np.array([h.stiffness for h in hinges], dtype=float),
        damping=np.array([h.damping for h in hinges]),
        rest=np.array([h.angle for h in hinges]),
        servo=servo,
        gravity=v["gravity"],
        half=v["foot_length"] / 2,
        normal=(2 * v["ground_stiffness"], 2 * v["ground_damping"]),
        friction=(v["friction_slide"], v["friction_stick"], v["friction_threshold"]),
    )


def state_of(data: mujoco.MjData) -> tuple[Array, Array]:
    """Return coordinates and rates of the twin's planar robot, whose angles are relative."""
    q, v = data.qpos.copy(), data.qvel.copy()
    q[2:], v[2:] = np.cumsum(q[2:]), np.cumsum(v[2:])
    return q, v


@numba.njit(cache=True)
def mass_matrix(c: Chain, q: Array, out: Array) -> None:
    """Write the mass matrix, (n + 2, n + 2)."""
    n = len(c.first)
    cos, sin = np.cos(q[2:]), np.sin(q[2:])
    out[0, 0] = out[1, 1] = c.total
    out[0, 1] = out[1, 0] = 0.0
    for i in range(n):
        out[2 + i, 0] = out[0, 2 + i] = -c.first[i] * sin[i]
        out[2 + i, 1] = out[1, 2 + i] = -c.first[i] * cos[i]
        for j in range(i + 1):
            m = c.second[i, j] * (cos[i] * cos[j] + sin[i] * sin[j])
            out[2 + i, 2 + j] = out[2 + j, 2 + i] = m


@numba.njit(cache=True)
def forces(c: Chain, q: Array, v: Array, act: float, omega: float, out: Array) -> None:
    """Write everything but the ground's forces, (n + 2,), less what the velocities take.

    Args:
        c: the robot.
        q: coordinates.
        v: their rates.
        act: commanded angle of the rotor against T [rad].
        omega: commanded speed [rad/s].
        out: (n + 2,).
    """
    n = len(c.first)
    cos, sin = np.cos(q[2:]), np.sin(q[2:])
    out[0], out[1] = 0.0, -c.total * c.gravity
    for j in range(n):
        square = v[2 + j] ** 2
        out[0] += c.first[j] * cos[j] * square
        out[1] -= c.first[j] * sin[j] * square
        out[2 + j] = c.gravity * c.first[j] * cos[j]
    for i in range(n):
        for j in range(n):
            turn = sin[i] * cos[j] - cos[i] * sin[j]
            out[2 + i] -= c.second[i, j] * turn * v[2 + j] ** 2
    for k in range(n - 2):
        bend, rate = q[3 + k] - q[2 + k], v[3 + k] - v[2 + k]
        torque = -c.stiffness[k] * (bend - c.rest[k]) - c.damping[k] * rate
        out[3 + k] += torque
        out[2 + k] -= torque
    torque = c.servo[0] * (act - q[n + 1] + q[n]) + c.servo[1] * (omega - v[n + 1] + v[n])
    out[n + 1] += torque
    out[n] -= torque


@numba.njit(cache=True)
def factor(m: Array) -> None:
    """Replace a symmetric positive definite matrix by its lower Cholesky factor."""
    n = len(m)
    for i in range(n):
        for j in range(i):
            total = m[i, j]
            for k in range(j):
                total -= m[i, k] * m[j, k]
            m[i, j] = total / m[j, j]
        total = m[i, i]
        for k in range(i):
            total -= m[i, k] * m[i, k]
        m[i, i] = np.sqrt(total)


@numba.njit(cache=True)
def solve(m: Array, b: Array) -> None:
    """Replace a right side by the solution, `m` being `factor`'s."""
    n = len(m)
    for i in range(n):
        total = b[i]
        for k in range(i):
            total -= m[i, k] * b[k]
        b[i] = total / m[i, i]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for k in range(i + 1, n):
            total -= m[k, i] * b[k]
        b[i] = total / m[i, i]
