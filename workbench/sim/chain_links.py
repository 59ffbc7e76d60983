"""Kinematics of planar chains side by side and the forces on their links, compiled.

Up to `LANES` chains of equal layout are computed at once, for steps and for statics. A block,
(n + 1, ROW), has a row for each link. In it are the columns of `LinkColumn` and those named here,
each with the numbers of all chains next to one another: a loop over chains is then one of vector
instructions. A constant is where its column begins in the row; chain i has its number i further.

Coordinates are forward, up and pitch of the root, then the angles of the hinges. Axes are those of
the world; a force is (torque, forward, up) about the link's own hinge.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim.beam_laws import top_force
from workbench.sim.chain import LinkColumn

__all__ = [
    "ACCELERATION",
    "COS",
    "CX",
    "CZ",
    "FI",
    "FORWARD",
    "FX",
    "FZ",
    "II",
    "IX",
    "IZ",
    "LANES",
    "LATER",
    "LOSS",
    "OVER",
    "ROW",
    "RX",
    "RZ",
    "SIN",
    "SOLVER",
    "TORQUE",
    "TURN",
    "UP",
    "XX",
    "XZ",
    "ZZ",
    "Q",
    "V",
    "add_force",
    "bend_hinges",
    "blocks_of",
    "compile_part",
    "place_links",
    "pull_top",
    "read_coordinates",
    "read_hinges",
    "read_rates",
]

Array = NDArray[np.float64]

LANES = 8
"""Chains of a block: two vectors of four numbers, of which each hides the other's delays."""

compile_part = numba.njit(error_model="numpy")
"""Compiles a function for compiled ones, with no test for zero at each division."""

_LINKS = len(LinkColumn)
_MASS, _X, _Z, _INERTIA, _AT_X, _AT_Z, _TURN = (LANES * int(LinkColumn(k)) for k in range(7))
_K0, _K1, _K2, _REST, _D0, _D1, _D2 = (LANES * int(LinkColumn(k)) for k in range(7, 14))

# of the hinge: its angle, speed, acceleration, and the speed at which centrifugal forces are taken
Q, V, ACCELERATION, LATER = (LANES * k for k in range(_LINKS, _LINKS + 4))
# position of a hinge from the one before; centripetal acceleration by the turning of the link
# before; articulated inertia, (turn, forward, up) and symmetric; force; 1 / inertia of the hinge;
# its torque and damping
RX, RZ, CX, CZ, II, IX, IZ, XX, XZ, ZZ, FI, FX, FZ, OVER, TORQUE, LOSS = (
    LANES * k for k in range(_LINKS + 4, _LINKS + 20)
)
# of the link in the world: its angle and how fast it turns; speed of its hinge; cosine and sine;
# acceleration by which it turns, and that of its hinge less gravity
_ANGLE, _SPIN, _VX, _VZ, COS, SIN, TURN, FORWARD, UP = (
    LANES * k for k in range(_LINKS + 20, _LINKS + 29)
)
SOLVER = LANES * (_LINKS + 29)
"""Where the columns of `chain_friction` begin."""
ROW = SOLVER + LANES * 5
"""How many numbers a row has."""

# an angle less quarter turns, whose first part is exact in 33 bits, and polynomials of its sine and
# cosine (FreeBSD's e_rem_pio2.c, k_sin.c and k_cos.c)
_QUARTERS, _QUARTER, _QUARTER_REST = 2 / math.pi, 1.57079632673412561417, 6.07710050650619224932e-11
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
_ROUNDS = 6755399441055744.0  # 1.5 * 2^52: what is added to it is rounded to a whole number


def blocks_of(links: Array) -> Array:
    """Return blocks of chains, (b, n + 1, ROW) [SI], each of `LANES` but the last.

    Args:
        links: (s, n + 1, 18) of `PlanarChain` [SI].
    """
    count = -(-len(links) // LANES)
    blocks = np.zeros((count, links.shape[1], ROW // LANES, LANES))
    for i, chain in enumerate(links):
        blocks[i // LANES, :, :_LINKS, i % LANES] = chain
    return blocks.reshape(count, links.shape[1], ROW)


@compile_part
def read_hinges(values: Array, column: int, lane: int, block: Array, of_root: Array) -> None:
    """Copy coordinates, rates or accelerations of a chain to its lane.

    Args:
        values: (n + 3,) [SI].
        column: where those of the hinges go.
        lane: of the chain.
        block: (n + 1, ROW) written.
        of_root: (LANES, 3) written.
    """
    for i in range(3):
        of_root[lane, i] = values[i]
    for k in range(1, block.shape[0]):
        block[k, column + lane] = values[2 + k]


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
def place_links(block: Array, feet: Array, rates: Array, lanes: int) -> None:
    """Write each link's position, inertia and centrifugal force.

    The C library has no cosine of several angles: its own would be half of a step.

    Args:
        block: (n + 1, ROW) with the hinges' angles in `Q` and speeds in `LATER`, written [SI].
        feet: (LANES, 3) forward, up and pitch of the root [m, rad].
        rates: (LANES, 3) of these [m/s, rad/s].
        lanes: chains of the block.
    """
    for i in range(lanes):
        block[0, _ANGLE + i], block[0, _SPIN + i] = feet[i, 2], rates[i, 2]
        block[0, _VX + i], block[0, _VZ + i] = rates[i, 0], rates[i, 1]
    for k in range(len(block)):
        if k > 0:
            _place_hinge(block, k, lanes)
        for i in range(lanes):
            angle = block[k, _ANGLE + i]
            quarters = (angle * _QUARTERS + _ROUNDS) - _ROUNDS
            rest = angle - quarters * _QUARTER - quarters * _QUARTER_REST
            z = rest * rest
            sine = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
            sine = rest + rest * z * (_S1 + z * sine)
            cosine = _C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))
            cosine = 1 - 0.5 * z + z * z * cosine
            halves = (quarters * 0.5 + _ROUNDS) - _ROUNDS
            odd = quarters - 2 * halves  # -1, 0 or 1 quarter turn beside half ones
            turned = halves - 2 * ((halves * 0.5 + _ROUNDS) - _ROUNDS)
            sign, even = 1 - 2 * turned * turned, 1 - odd * odd
            block[k, SIN + i] = sign * (even * sine + odd * cosine)
            block[k, COS + i] = sign * (even * cosine - odd * sine)
        for i in range(lanes):
            mass, turn = block[k, _MASS + i], block[k, _SPIN + i]
            c, s = block[k, COS + i], block[k, SIN + i]
            x = mass * (c * block[k, _X + i] + s * block[k, _Z + i])
            z = mass * (c * block[k, _Z + i] - s * block[k, _X + i])
            block[k, II + i], block[k, IX + i], block[k, IZ + i] = block[k, _INERTIA + i], z, -x
            block[k, XX + i], block[k, XZ + i], block[k, ZZ + i] = mass, 0.0, mass
            block[k, FI + i] = 0.0
            block[k, FX + i], block[k, FZ + i] = -turn * turn * x, -turn * turn * z


@compile_part
def _place_hinge(block: Array, k: int, lanes: int) -> None:
    """Write the position of a hinge and the angle of its link, the link before being placed."""
    for i in range(lanes):
        c, s, turn = block[k - 1, COS + i], block[k - 1, SIN + i], block[k - 1, _SPIN + i]
        x = c * block[k, _AT_X + i] + s * block[k, _AT_Z + i]
        z = c * block[k, _AT_Z + i] - s * block[k, _AT_X + i]
        block[k, RX + i], block[k, RZ + i] = x, z
        block[k, CX + i], block[k, CZ + i] = -turn * turn * x, -turn * turn * z
        block[k, _VX + i] = block[k - 1, _VX + i] + turn * z
        block[k, _VZ + i] = block[k - 1, _VZ + i] - turn * x
        block[k, _ANGLE + i] = block[k - 1, _ANGLE + i] + (block[k, _TURN + i] + block[k, Q + i])
        block[k, _SPIN + i] = turn + block[k, LATER + i]


@compile_part
def bend_hinges(block: Array, lanes: int) -> None:
    """Write the torque of each hinge's spring and damper, and the damper's derivative.

    Args:
        block: (n + 1, ROW) written [SI].
        lanes: chains of the block.
    """
    for k in range(1, len(block)):
        for i in range(lanes):
            bent, speed = block[k, Q + i] - block[k, _REST + i], block[k, V + i]
            d0, d1, d2 = block[k, _D0 + i], block[k, _D1 + i], block[k, _D2 + i]
            fast = abs(speed)
            spring = block[k, _K0 + i] + bent * (block[k, _K1 + i] + bent * block[k, _K2 + i])
            block[k, TORQUE + i] = -bent * spring - speed * (d0 + fast * (d1 + fast * d2))
            block[k, LOSS + i] = d0 + fast * (2 * d1 + fast * 3 * d2)


@compile_part
def add_force(block: Array, k: int, lane: int, at: Array, fx: float, fz: float) -> None:
    """Add a force on a link of one chain.

    Args:
        block: (n + 1, ROW) added to [SI].
        k: number of the link.
        lane: of the chain.
        at: (4,) whose second and third are the point, forward and up in the link's frame [m].
        fx: forward [N].
        fz: up [N].
    """
    c, s = block[k, COS + lane], block[k, SIN + lane]
    dx, dz = c * at[1] + s * at[2], c * at[2] - s * at[1]
    block[k, FI + lane] -= dz * fx - dx * fz
    block[k, FX + lane] -= fx
    block[k, FZ + lane] -= fz


@compile_part
def pull_top(block: Array, lane: int, laws: Array, top: Array, forward: float) -> None:
    """Add the forces of `beam_laws` at T and at the foot's hinge of one chain.

    Args:
        block: (n + 1, ROW) added to [SI].
        lane: of the chain.
        laws: (10,) of `PlanarChain` [SI].
        top: (4,) of `PlanarChain` [m, rad].
        forward: position of the root [m].
    """
    link, x = int(top[0]), forward
    for k in range(1, link + 1):
        x += block[k, RX + lane]
    c, s, turn = block[link, COS + lane], block[link, SIN + lane], block[link, _SPIN + lane]
    dx, dz = c * top[1] + s * top[2], c * top[2] - s * top[1]
    vx, vz = block[link, _VX + lane] + turn * dz, block[link, _VZ + lane] - turn * dx
    fx, _, fz = top_force(laws, x + dx, vx, 0.0, vz)
    add_force(block, link, lane, top, fx, fz)
    if laws[5] > 0.0:  # within the play the spring of the foot's hinge, the first, gives nothing
        bent = block[1, Q + lane] - block[1, _REST + lane]
        block[1, TORQUE + lane] += block[1, _K0 + lane] * min(max(bent, -laws[5]), laws[5])
