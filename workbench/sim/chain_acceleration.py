"""The acceleration of planar chains under forces, compiled: articulated bodies.

Featherstone's recursion (Rigid Body Dynamics Algorithms, 2008, table 7.1) goes link by link, tip to
root and back; here each link has three degrees of freedom, turn, forward, up, about its own hinge,
the axes those of the world. For a link turned by angle w' and a point (x, z) from its hinge, the
point's acceleration is a + w' (z, -x) - w^2 (x, z).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import LinkColumn
from workbench.sim.chain_links import (
    ACCELERATION,
    CX,
    CZ,
    FI,
    FORWARD,
    FX,
    FZ,
    II,
    IX,
    IZ,
    LANES,
    LOSS,
    OVER,
    RX,
    RZ,
    TORQUE,
    TURN,
    UP,
    XX,
    XZ,
    ZZ,
    compile_part,
)

__all__ = ["accelerate_hinges", "accelerate_root", "sum_inertias"]

Array = NDArray[np.float64]

_ARMATURE = LANES * int(LinkColumn.ARMATURE)


@compile_part
def sum_inertias(block: Array, step: Array, lanes: int) -> None:
    """Add each link's articulated inertia and force to the link before, tip to root.

    Args:
        block: (n + 1, ROW) of placed links and the torques of their hinges, changed [SI].
        step: (LANES,) times which the column `LOSS` is added to the inertia of each hinge [s].
        lanes: chains of the block.
    """
    for k in range(len(block) - 1, 0, -1):
        _add_inertia(block[k], block[k - 1], step, lanes)


@compile_part
def _add_inertia(own: Array, before: Array, step: Array, lanes: int) -> None:
    """Add a link's inertia and force to the link before.

    Rows are arguments of their own, for the compiler to see that they do not overlap.
    """
    for i in range(lanes):
        a, b, c = own[II + i], own[IX + i], own[IZ + i]
        over = 1.0 / (a + own[_ARMATURE + i] + step[i] * own[LOSS + i])
        torque = own[TORQUE + i] - own[FI + i]
        own[TORQUE + i], own[OVER + i] = torque, over
        free = torque * over
        xx, xz, zz = own[XX + i], own[XZ + i], own[ZZ + i]
        xx, xz, zz = xx - b * b * over, xz - b * c * over, zz - c * c * over
        ii, ix, iz = a - a * a * over, b - a * b * over, c - a * c * over
        rx, rz, cx, cz = own[RX + i], own[RZ + i], own[CX + i], own[CZ + i]
        fi = own[FI + i] + ix * cx + iz * cz + a * free
        fx = own[FX + i] + xx * cx + xz * cz + b * free
        fz = own[FZ + i] + xz * cx + zz * cz + c * free
        at_x, at_z = ix + xx * rz - xz * rx, iz + xz * rz - zz * rx
        before[II + i] += ii + rz * ix - rx * iz + rz * at_x - rx * at_z
        before[IX + i] += at_x
        before[IZ + i] += at_z
        before[XX + i] += xx
        before[XZ + i] += xz
        before[ZZ + i] += zz
        before[FI + i] += fi + rz * fx - rx * fz
        before[FX + i] += fx
        before[FZ + i] += fz


@compile_part
def accelerate_root(block: Array, gravity: Array, free: bool, ground: Array, lanes: int) -> None:
    """Write the acceleration of the root, less gravity.

    Args:
        block: (n + 1, ROW) of the links, summed up, written [SI].
        gravity: (LANES, 2) forward and up [m/s^2].
        free: whether the root moves.
        ground: (LANES, 3) force forward, up and torque of the ground [N, N m].
        lanes: chains of the block.
    """
    for i in range(lanes):
        if not free:
            block[0, TURN + i] = 0.0
            block[0, FORWARD + i], block[0, UP + i] = -gravity[i, 0], -gravity[i, 1]
            continue
        a, b, c = block[0, II + i], block[0, IX + i], block[0, IZ + i]
        d, e, f = block[0, XX + i], block[0, XZ + i], block[0, ZZ + i]
        fx, fz = ground[i, 0] - block[0, FX + i], ground[i, 1] - block[0, FZ + i]
        over = 1.0 / (d * f - e * e)
        xx, xz, zz = f * over, -e * over, d * over
        along, above = b * xx + c * xz, b * xz + c * zz
        torque = ground[i, 2] - block[0, FI + i] - along * fx - above * fz
        turn = torque / (a - along * b - above * c)
        fx, fz = fx - b * turn, fz - c * turn
        block[0, TURN + i] = turn
        block[0, FORWARD + i], block[0, UP + i] = xx * fx + xz * fz, xz * fx + zz * fz


@compile_part
def accelerate_hinges(block: Array, lanes: int) -> None:
    """Write the acceleration of each hinge's angle, of its place and of its link's turn.

    Args:
        block: (n + 1, ROW) of the links, summed up, the root accelerated, written [SI].
        lanes: chains of the block.
    """
    for k in range(1, len(block)):
        for i in range(lanes):
            turn, rx, rz = block[k - 1, TURN + i], block[k, RX + i], block[k, RZ + i]
            forward = block[k - 1, FORWARD + i] + turn * rz + block[k, CX + i]
            up = block[k - 1, UP + i] - turn * rx + block[k, CZ + i]
            inertial = block[k, II + i] * turn + block[k, IX + i] * forward + block[k, IZ + i] * up
            joint = (block[k, TORQUE + i] - inertial) * block[k, OVER + i]
            block[k, ACCELERATION + i], block[k, TURN + i] = joint, turn + joint
            block[k, FORWARD + i], block[k, UP + i] = forward, up
