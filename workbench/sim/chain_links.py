"""Kinematics of a planar chain's links and the forces on them, compiled, for steps and statics.

Coordinates are forward, up and pitch of the root, then the angles of the hinges. `work` has a row
for each link and the columns named here. Axes are those of the world; a force is (torque, forward,
up) about the link's own hinge.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim.beam_laws import top_force
from workbench.sim.chain import LinkColumn

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
    "read_coordinates",
    "read_rates",
]

Array = NDArray[np.float64]

compile_part = numba.njit(error_model="numpy")
"""Compiles a function for compiled ones, with no test for zero at each division."""

_MASS, _X, _Z, _INERTIA, _AT_X, _AT_Z, _TURN = (int(LinkColumn(k)) for k in range(7))
_K0, _K1, _K2, _REST, _D0, _D1, _D2, _ARMATURE = (int(LinkColumn(k)) for k in range(7, 15))

# position of a hinge from the one before; centripetal acceleration by the turning of the link
# before; articulated inertia, (turn, forward, up) and symmetric; force; 1 / inertia of the hinge;
# its torque and damping; speed of its hinge in the world; cosine and sine
RX, RZ, CX, CZ, II, IX, IZ, XX, XZ, ZZ, FI, FX, FZ, OVER = range(14)
TORQUE, LOSS, VX, VZ, COS, SIN = range(14, 20)
WORK = 20
"""How many columns there are."""


@compile_part
def read_coordinates(root: int, qpos: Array, q: Array) -> None:
    """Copy the engine's coordinates to forward, up, pitch of the root and the hinges' angles.

    Args:
        root: its degrees of freedom.
        qpos: (nq,) of the engine [m, rad].
        q: (n + 3,) coordinates, written [m, rad].
    """
    first = 3 if root == 6 else 3 - root
    q[:first] = 0.0
    if root == 6:
        q[0], q[1], q[2] = qpos[0], qpos[2], 2 * math.atan2(qpos[5], qpos[3])
    angles = len(qpos) - len(q)
    for i in range(first, len(q)):
        q[i] = qpos[angles + i]


@compile_part
def read_rates(root: int, qvel: Array, v: Array) -> None:
    """Copy the engine's speeds or accelerations to those of a chain's coordinates.

    Args:
        root: its degrees of freedom.
        qvel: (nv,) of the engine [SI].
        v: (n + 3,) of the coordinates, written [SI].
    """
    first = 3 if root == 6 else 3 - root
    v[:first] = 0.0
    if root == 6:
        v[0], v[1], v[2] = qvel[0], qvel[2], qvel[4]
    speeds = len(qvel) - len(v)
    for i in range(first, len(v)):
        v[i] = qvel[speeds + i]


@compile_part
def place_links(links: Array, q: Array, v: Array, work: Array) -> None:
    """Write each link's position, inertia and centrifugal force.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI].
        q: (n + 3,) coordinates [m, rad].
        v: (n + 3,) their rates [m/s, rad/s].
        work: (n + 1, WORK) written [SI].
    """
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
    """Write the torque of each hinge's spring and damper, and the damper's derivative.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI].
        q: (n + 3,) coordinates [m, rad].
        v: (n + 3,) their rates [m/s, rad/s].
        work: (n + 1, WORK) written [SI].
    """
    for k in range(1, links.shape[0]):
        bent, speed = q[2 + k] - links[k, _REST], v[2 + k]
        fast = abs(speed)
        spring = bent * (links[k, _K0] + bent * (links[k, _K1] + bent * links[k, _K2]))
        damper = speed * (links[k, _D0] + fast * (links[k, _D1] + fast * links[k, _D2]))
        work[k, TORQUE] = -spring - damper
        work[k, LOSS] = links[k, _D0] + fast * (2 * links[k, _D1] + fast * 3 * links[k, _D2])


@compile_part
def add_force(work: Array, k: int, at: Array, fx: float, fz: float) -> None:
    """Add a force on a link.

    Args:
        work: (n + 1, WORK) added to [SI].
        k: number of the link.
        at: (4,) whose second and third are the point, forward and up in the link's frame [m].
        fx: forward [N].
        fz: up [N].
    """
    c, s = work[k, COS], work[k, SIN]
    dx, dz = c * at[1] + s * at[2], c * at[2] - s * at[1]
    work[k, FI] -= dz * fx - dx * fz
    work[k, FX] -= fx
    work[k, FZ] -= fz


@compile_part
def pull_top(links: Array, laws: Array, top: Array, q: Array, v: Array, work: Array) -> None:
    """Add the forces of `beam_laws` at T and at the foot's hinge.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI].
        laws: (10,) of `PlanarChain` [SI].
        top: (4,) of `PlanarChain` [m, rad].
        q: (n + 3,) coordinates [m, rad].
        v: (n + 3,) their rates [m/s, rad/s].
        work: (n + 1, WORK) added to [SI].
    """
    link, x, turn = int(top[0]), q[0], v[2]
    for k in range(1, link + 1):
        x += work[k, RX]
        turn += v[2 + k]
    c, s = work[link, COS], work[link, SIN]
    dx, dz = c * top[1] + s * top[2], c * top[2] - s * top[1]
    vx, vz = work[link, VX] + turn * dz, work[link, VZ] - turn * dx
    fx, _, fz = top_force(laws, x + dx, vx, 0.0, vz)
    add_force(work, link, top, fx, fz)
    if laws[5] > 0.0:  # within the play the spring of the foot's hinge, the first, gives nothing
        bent = q[3] - links[1, _REST]
        work[1, TORQUE] += links[1, _K0] * min(max(bent, -laws[5]), laws[5])
