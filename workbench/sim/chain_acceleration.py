"""The acceleration of a planar chain under forces, compiled: articulated bodies.

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
    CX,
    CZ,
    FI,
    FX,
    FZ,
    II,
    IX,
    IZ,
    LOSS,
    OVER,
    RX,
    RZ,
    TORQUE,
    XX,
    XZ,
    ZZ,
    compile_part,
)

__all__ = ["hinge_gains", "root_gains", "sum_inertias"]

Array = NDArray[np.float64]

_ARMATURE = int(LinkColumn.ARMATURE)


@compile_part
def sum_inertias(links: Array, step: float, work: Array) -> None:
    """Add each link's articulated inertia and force to the link before, tip to root.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI].
        step: times which the column `LOSS` is added to the inertia of each hinge [s].
        work: (n + 1, WORK) of placed links and the torques of their hinges, changed [SI].
    """
    for k in range(links.shape[0] - 1, 0, -1):
        a, b, c = work[k, II], work[k, IX], work[k, IZ]
        over = 1.0 / (a + links[k, _ARMATURE] + step * work[k, LOSS])
        work[k, TORQUE] -= work[k, FI]
        work[k, OVER] = over
        own = work[k, TORQUE] * over
        xx, xz, zz = work[k, XX], work[k, XZ], work[k, ZZ]
        xx, xz, zz = xx - b * b * over, xz - b * c * over, zz - c * c * over
        ii, ix, iz = a - a * a * over, b - a * b * over, c - a * c * over
        rx, rz, cx, cz = work[k, RX], work[k, RZ], work[k, CX], work[k, CZ]
        fi = work[k, FI] + ix * cx + iz * cz + a * own
        fx = work[k, FX] + xx * cx + xz * cz + b * own
        fz = work[k, FZ] + xz * cx + zz * cz + c * own
        at_x, at_z = ix + xx * rz - xz * rx, iz + xz * rz - zz * rx
        work[k - 1, II] += ii + rz * ix - rx * iz + rz * at_x - rx * at_z
        work[k - 1, IX] += at_x
        work[k - 1, IZ] += at_z
        work[k - 1, XX] += xx
        work[k - 1, XZ] += xz
        work[k - 1, ZZ] += zz
        work[k - 1, FI] += fi + rz * fx - rx * fz
        work[k - 1, FX] += fx
        work[k - 1, FZ] += fz


@compile_part
def root_gains(work: Array, foot: Array) -> tuple[float, float, float]:
    """Return the acceleration of a free root, turn, forward, up, less gravity.

    Args:
        work: (n + 1, WORK) of the links, summed up [SI].
        foot: (3,) force forward, up and torque of the ground [N, N m].
    """
    a, b, c = work[0, II], work[0, IX], work[0, IZ]
    d, e, f = work[0, XX], work[0, XZ], work[0, ZZ]
    fx, fz = foot[0] - work[0, FX], foot[1] - work[0, FZ]
    over = 1.0 / (d * f - e * e)
    xx, xz, zz = f * over, -e * over, d * over
    along, above = b * xx + c * xz, b * xz + c * zz
    torque = foot[2] - work[0, FI] - along * fx - above * fz
    turn = torque / (a - along * b - above * c)
    fx, fz = fx - b * turn, fz - c * turn
    return turn, xx * fx + xz * fz, xz * fx + zz * fz


@compile_part
def hinge_gains(
    work: Array, k: int, turn: float, forward: float, up: float
) -> tuple[float, float, float]:
    """Return the acceleration of a hinge's angle, and forward and up that of its place.

    Args:
        work: (n + 1, WORK) of the links, summed up [SI].
        k: number of its link.
        turn: acceleration of the link before [rad/s^2].
        forward: of the hinge of that link [m/s^2].
        up: the same [m/s^2].
    """
    forward, up = (
        forward + turn * work[k, RZ] + work[k, CX],
        up - turn * work[k, RX] + work[k, CZ],
    )
    inertial = work[k, II] * turn + work[k, IX] * forward + work[k, IZ] * up
    return (work[k, TORQUE] - inertial) * work[k, OVER], forward, up
