"""The stiffness matrix of a planar chain at rest, compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain_links import (
    FI,
    FX,
    FZ,
    IX,
    IZ,
    RX,
    RZ,
    TORQUE,
    WORK,
    XX,
    add_force,
    bend_hinges,
    compile_part,
    place_links,
    pull_top,
    read_coordinates,
)
from workbench.sim.compiling import compiled
from workbench.sim.ground import GROUND_RECORD, planar_forces

__all__ = ["stiffness_of_chain"]

Array = NDArray[np.float64]


def _stiffness_of_chain(
    links: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    root: int,
    qpos: Array,
    directions: Array,
    dofs: NDArray[np.int64],
    step: float,
    pulled: Array,
    pull: Array,
) -> Array:
    """Return minus the derivative of the unbalanced force, (n, n) [N, N m by m, rad], at rest.

    Central differences; the foot's corners lock where they are.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI], as all that follows up to the root.
        ground: (18,) [SI].
        laws: (10,) [SI].
        top: (4,) [m, rad].
        gravity: (2,) [m/s^2].
        root: degrees of freedom of the root.
        qpos: (nq,) of the engine [m, rad].
        directions: (n, links + 2) unit displacements [m, rad]; forward, up, pitch of the root,
            hinges.
        dofs: (n,) whose forces are returned, counted likewise.
        step: of the differences [m, rad].
        pulled: (4,) link and position of a force on T [m, rad].
        pull: (2,) that force, forward and up [N].
    """
    size, count = len(dofs), links.shape[0] + 2
    q, v, foot = np.empty(count), np.zeros(count), np.empty(3)
    user, work = np.empty(GROUND_RECORD), np.empty((links.shape[0], WORK))
    sides, found = np.empty((2, size)), np.empty((size, size))
    for column in range(size):
        for side in range(2):
            read_coordinates(root, qpos, q)
            for i in range(count):
                q[i] += (step - 2 * step * side) * directions[column, i]
            user[:] = 0.0
            foot[0] = foot[1] = foot[2] = 0.0
            if ground[0] != 0.0:
                planar_forces(ground, q, v, user, foot)
            place_links(links, q, v, work)
            bend_hinges(links, q, v, work)
            if laws[0] != 0.0:
                pull_top(links, laws, top, q, v, work)
            add_force(work, int(pulled[0]), pulled, pull[0], pull[1])
            _sum_forces(gravity, foot, work)
            for i in range(size):
                k = dofs[i]
                sides[side, i] = (
                    -work[0, FX + k] if k < 2 else -work[0, FI] if k == 2 else work[k - 2, TORQUE]
                )
        for i in range(size):
            found[i, column] = (sides[1, i] - sides[0, i]) / (2 * step)
    return found


@compile_part
def _sum_forces(gravity: Array, foot: Array, work: Array) -> None:
    """Sum up, tip to root, gravity and the forces on links at each hinge of a chain at rest."""
    for k in range(work.shape[0] - 1, -1, -1):
        work[k, FI] -= work[k, IX] * gravity[0] + work[k, IZ] * gravity[1]
        work[k, FX] -= work[k, XX] * gravity[0]
        work[k, FZ] -= work[k, XX] * gravity[1]
        if k == 0:
            work[0, FI] -= foot[2]
            work[0, FX] -= foot[0]
            work[0, FZ] -= foot[1]
            break
        work[k, TORQUE] -= work[k, FI]
        fx, fz = work[k, FX], work[k, FZ]
        work[k - 1, FI] += work[k, FI] + work[k, RZ] * fx - work[k, RX] * fz
        work[k - 1, FX] += fx
        work[k - 1, FZ] += fz


stiffness_of_chain: Callable[..., Array] = compiled(_stiffness_of_chain)
