"""Unbalanced forces of a planar chain at rest and their derivatives, compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain_links import (
    COS,
    FI,
    FX,
    FZ,
    IX,
    IZ,
    LANES,
    RX,
    RZ,
    SIN,
    TORQUE,
    XX,
    Q,
    add_force,
    bend_hinges,
    compile_part,
    place_links,
    pull_top,
    read_coordinates,
    read_hinges,
)
from workbench.sim.compiling import compiled
from workbench.sim.ground import GROUND_RECORD, planar_forces

__all__ = ["balance_of_chain"]

Array = NDArray[np.float64]


def _balance_of_chain(
    block: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    root: int,
    qpos: Array,
    around: Array,
    directions: Array,
    dofs: NDArray[np.int64],
    step: float,
    pulled: Array,
    pull: Array,
) -> tuple[Array, Array, Array, Array]:
    """Return force and stiffness of a chain at rest, and place and slopes of a point of it.

    Derivatives are central differences; the foot's corners lock where they are.

    Args:
        block: (n + 1, ROW) of `blocks_of`, as many as it has of the chain; used up [SI].
        ground: (18,) of `PlanarChain` [SI], as all that follows up to the root.
        laws: (10,) [SI].
        top: (4,) [m, rad].
        gravity: (2,) [m/s^2].
        root: degrees of freedom of the root.
        qpos: (nq,) of the engine [m, rad].
        around: (nq,) pose around which differences are taken [m, rad].
        directions: (n, links + 2) unit displacements [m, rad]; forward, up, pitch of the root,
            hinges.
        dofs: (n,) whose forces are returned, counted likewise.
        step: of the differences [m, rad].
        pulled: (4,) link and position of the point, on which a force acts [m, rad].
        pull: (2,) that force, forward and up [N].

    Returns:
        The unbalanced force (n,) [N, N m], minus its derivative (n, n) [N, N m by m, rad], the
        point's position forward and up (2,) [m], and its derivative (2, n) [m by m, rad].
    """
    size, count = len(dofs), len(block) + 2
    q, still, user = np.empty(count), np.zeros((LANES, 3)), np.empty(GROUND_RECORD)
    feet, pushed = np.empty((2, LANES, 3))
    forces, places = np.empty((2 * size + 1, size)), np.empty((2 * size + 1, 2))
    for first in range(0, 2 * size + 1, LANES):
        lanes = min(LANES, 2 * size + 1 - first)
        for i in range(lanes):
            column, side = divmod(first + i, 2)
            if column < size:
                read_coordinates(root, around, q)
                q += (step - 2 * step * side) * directions[column]
            else:
                read_coordinates(root, qpos, q)
            read_hinges(q, Q, i, block, feet)
            pushed[i], user[:] = 0.0, 0.0
            if ground[0] != 0.0:
                planar_forces(ground, feet[i], still[i], user, pushed[i])
        place_links(block, feet, still, lanes)
        bend_hinges(block, lanes)
        for i in range(lanes):
            if laws[0] != 0.0:
                pull_top(block, i, laws, top, feet[i, 0])
            add_force(block, int(pulled[0]), i, pulled, pull[0], pull[1])
            _sum_forces(block, i, gravity, pushed[i])
            for j in range(size):
                forces[first + i, j] = _unbalanced(block, i, dofs[j])
            _place(block, i, pulled, feet, places[first + i])
    stiffness, slopes = np.empty((size, size)), np.empty((2, size))
    for column in range(size):
        ahead, behind = 2 * column, 2 * column + 1
        for j in range(size):
            stiffness[j, column] = (forces[behind, j] - forces[ahead, j]) / (2 * step)
        for j in range(2):
            slopes[j, column] = (places[ahead, j] - places[behind, j]) / (2 * step)
    return forces[2 * size], stiffness, places[2 * size], slopes


@compile_part
def _place(block: Array, lane: int, at: Array, feet: Array, found: Array) -> None:
    """Write where a point of a link is, forward and up, (2,) [m]."""
    link = int(at[0])
    c, s = block[link, COS + lane], block[link, SIN + lane]
    found[0] = feet[lane, 0] + c * at[1] + s * at[2]
    found[1] = feet[lane, 1] + c * at[2] - s * at[1]
    for k in range(1, link + 1):
        found[0] += block[k, RX + lane]
        found[1] += block[k, RZ + lane]


@compile_part
def _unbalanced(block: Array, lane: int, dof: int) -> float:
    """Return the force or torque that a degree of freedom is left with, its forces summed up."""
    if dof < 2:
        return -block[0, (FX if dof == 0 else FZ) + lane]
    return -block[0, FI + lane] if dof == 2 else block[dof - 2, TORQUE + lane]


@compile_part
def _sum_forces(block: Array, lane: int, gravity: Array, ground: Array) -> None:
    """Sum up, tip to root, gravity and the forces on links at each hinge of a chain at rest."""
    for k in range(len(block) - 1, -1, -1):
        block[k, FI + lane] -= block[k, IX + lane] * gravity[0] + block[k, IZ + lane] * gravity[1]
        block[k, FX + lane] -= block[k, XX + lane] * gravity[0]
        block[k, FZ + lane] -= block[k, XX + lane] * gravity[1]
        if k == 0:
            block[k, FX + lane] -= ground[0]
            block[k, FZ + lane] -= ground[1]
            block[k, FI + lane] -= ground[2]
            break
        block[k, TORQUE + lane] -= block[k, FI + lane]
        fx, fz = block[k, FX + lane], block[k, FZ + lane]
        block[k - 1, FI + lane] += (
            block[k, FI + lane] + block[k, RZ + lane] * fx - block[k, RX + lane] * fz
        )
        block[k - 1, FX + lane] += fx
        block[k - 1, FZ + lane] += fz


balance_of_chain: Callable[..., tuple[Array, Array, Array, Array]] = compiled(_balance_of_chain)
