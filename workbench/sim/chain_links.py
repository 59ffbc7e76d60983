"""Where the links of a planar chain are and what acts on them, compiled: of steps and statics.

Coordinates are forward, up and pitch of the root, then the angles of the hinges. `work` has a row a
link and the columns named here. Axes are those of the world; a force is (turn, forward, up) about
the link's own hinge.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import Link
from workbench.sim.laws import top_force

__all__ = [
    "COS",
    "CX",
    "CZ",
    "FI",
    "FX",
    "FZ",
    "II",
    "IX",
    "IZ",
    "LOSS",
    "OVER",
    "RX",
    "RZ",
    "SIN",
    "TORQUE",
    "VX",
    "VZ",
    "WORK",
    "XX",
    "XZ",
    "ZZ",
    "add_force",
    "bend_hinges",
    "compile_part",
    "place_links",
    "pull_top",
    "take_coordinates",
]

Array = NDArray[np.float64]

compile_part = numba.njit(error_model="numpy")
"""Compiles what a compiled function calls, with no test for zero at each division."""

_MASS, _X, _Z, _INERTIA, _AT_X, _AT_Z, _TURN = (int(Link(k)) for k in range(7))
_K0, _K1, _K2, _REST, _D0, _D1, _D2, _ARMATURE = (int(Link(k)) for k in range(7, 15))

# place of a hinge from the one before; what the turning of the link before adds to its
# acceleration; articulated inertia, (turn, forward, up) and symmetric; force; 1 / inertia of the
# hinge; its torque and damping; speed of its hinge in the world; cosine and sine
RX, RZ, CX, CZ, II, IX, IZ, XX, XZ, ZZ, FI, FX, FZ, OVER = range(14)
TORQUE, LOSS, VX, VZ, COS, SIN = range(14, 20)
WORK = 20
"""How many columns there are."""


@compile_part
def take_coordinates(root: int, qpos: Array, qvel: Array, q: Array, v: Array) -> None:
    """Copy the engine's coordinates to forward, up, pitch of the root and the hinges' angles."""
    first = 3 if root == 6 else 3 - root
    for i in range(first):
        q[i] = v[i] = 0.0
    if root == 6:
        q[0], q[1], q[2] = qpos[0], qpos[2], 2 * math.atan2(qpos[5], qpos[3])
        v[0], v[1], v[2] = qvel[0], qvel[2], qvel[4]
    places, speeds = len(qpos) - len(q), len(qvel) - len(v)
    for i in range(first, len(q)):
        q[i], v[i] = qpos[places + i], qvel[speeds + i]


@compile_part
def place_links(links: Array, q: Array, v: Array, work: Array) -> None:
    """Write each link's place, inertia and centrifugal force."""
    angle, turn = q[2], v[2]
    c, s = math.cos(angle), math.sin(angle)
    vx, vz = v[0], v[1]
    for k in range(links.shape[0]):
        if k > 0:
            x = c * links[k, _AT_X] + s * links[k, _AT_Z]
            z = c * links[k, _AT_Z] - s * links[k, _AT_X]
            work[k, RX], work[k, RZ] = x, z
            work[k, CX], work[k, CZ] = -turn * turn * x, -turn * turn * z
            vx, vz = vx + turn * z, vz - turn * x
            angle += links[k, _TURN] + q[2 + k]
            turn += v[2 + k]
            c, s = math.cos(angle), math.sin(angle)
        mass = links[k, _MASS]
        x = mass * (c * links[k, _X] + s * links[k, _Z])
        z = mass * (c * links[k, _Z] - s * links[k, _X])
        work[k, II], work[k, IX], work[k, IZ] = links[k, _INERTIA], z, -x
        work[k, XX], work[k, XZ], work[k, ZZ] = mass, 0.0, mass
        work[k, FI], work[k, FX], work[k, FZ] = 0.0, -turn * turn * x, -turn * turn * z
        work[k, VX], work[k, VZ], work[k, COS], work[k, SIN] = vx, vz, c, s


@compile_part
def bend_hinges(links: Array, q: Array, v: Array, work: Array) -> None:
    """Write the torque of each hinge's spring and damper, and the damper's derivative."""
    for k in range(1, links.shape[0]):
        bent, speed = q[2 + k] - links[k, _REST], v[2 + k]
        fast = abs(speed)
        spring = bent * (links[k, _K0] + bent * (links[k, _K1] + bent * links[k, _K2]))
        damper = speed * (links[k, _D0] + fast * (links[k, _D1] + fast * links[k, _D2]))
        work[k, TORQUE] = -spring - damper
        work[k, LOSS] = links[k, _D0] + fast * (2 * links[k, _D1] + fast * 3 * links[k, _D2])


@compile_part
def add_force(work: Array, k: int, place: Array, fx: float, fz: float) -> None:
    """Let a force act on a link at a place of its frame."""
    c, s = work[k, COS], work[k, SIN]
    dx, dz = c * place[1] + s * place[2], c * place[2] - s * place[1]
    work[k, FI] -= dz * fx - dx * fz
    work[k, FX] -= fx
    work[k, FZ] -= fz


@compile_part
def pull_top(links: Array, laws: Array, top: Array, q: Array, v: Array, work: Array) -> None:
    """Add what `laws` does to T and at the foot's hinge."""
    carrier, x, turn = int(top[0]), q[0], v[2]
    for k in range(1, carrier + 1):
        x += work[k, RX]
        turn += v[2 + k]
    c, s = work[carrier, COS], work[carrier, SIN]
    dx, dz = c * top[1] + s * top[2], c * top[2] - s * top[1]
    vx, vz = work[carrier, VX] + turn * dz, work[carrier, VZ] - turn * dx
    fx, _, fz = top_force(laws, x + dx, vx, 0.0, vz)
    add_force(work, carrier, top, fx, fz)
    if laws[5] > 0.0:  # within the play the spring of the foot's hinge, the first, gives nothing
        bent = q[3] - links[1, _REST]
        work[1, TORQUE] += links[1, _K0] * min(max(bent, -laws[5]), laws[5])
