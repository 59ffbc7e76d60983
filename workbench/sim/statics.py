"""The unbalanced static force and its derivative by the pose, the static stiffness."""

from __future__ import annotations

from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.sim.beam_laws import leave_edge
from workbench.sim.chain import PlanarChain
from workbench.sim.chain_links import LANES, blocks_of
from workbench.sim.chain_statics import stiffness_of_chain
from workbench.sim.robot import Foot

__all__ = ["RotorKeeps", "displace", "moving_dofs", "static_force", "static_stiffness"]

RotorKeeps = Literal["world", "top"]
"""Frame in which the rotor keeps its angle while the rest moves; locked to T it turns with T."""

_DIFFERENCE = 1e-6  # [m, rad]
# the one moving degree of freedom that is no rotation, by the type of the model's first joint
_HEIGHT = {int(mujoco.mjtJoint.mjJNT_FREE): 2, int(mujoco.mjtJoint.mjJNT_SLIDE): 1}


def moving_dofs(model: mujoco.MjModel, foot: Foot) -> NDArray[np.int_]:
    """Return the dofs that gravity moves, (n,): all but the rotor, of the foot z and pitch.

    The robot is symmetric sideways and about its vertical; the ground holds it forward.
    """
    rotor = model.joint("rotor").dofadr[0]
    held = {rotor}
    if foot == "free":
        held |= {0} if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_SLIDE else {0, 1, 3, 5}
    return np.array([dof for dof in range(model.nv) if dof not in held])


def static_force(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the unbalanced force, (nv,) [N, N m]; the corners lock where they are."""
    data.qvel[:] = 0
    return _static_force(model, data, model.body("top").id)


def _static_force(model: mujoco.MjModel, data: mujoco.MjData, top: int) -> NDArray[np.float64]:
    """Return the unbalanced force of a pose at rest; `top` is T's body."""
    data.userdata[:] = 0
    mujoco.mj_forward(model, data)
    force = data.qfrc_passive - data.qfrc_bias
    pull = data.xfrc_applied[top, :3]
    if pull.any():
        pulled = np.zeros(model.nv)
        mujoco.mj_applyFT(model, data, pull, np.zeros(3), data.xpos[top], top, pulled)
        force += pulled
    return force


def static_stiffness(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    dofs: NDArray[np.int_],
    rotor_keeps: RotorKeeps = "world",
    chain: PlanarChain | None = None,
    within: bool = False,
) -> NDArray[np.float64]:
    """Return minus the static force's derivative, (n, n) [N/m, N m/rad], by central differences.

    The data's pose is left as it was, its forces are those of the last difference. At the edge of
    its play the foot joint is taken to be beyond it: differences across the edge would see half of
    its spring.

    Args:
        model: of the robot.
        data: at the pose.
        dofs: (n,) degrees of freedom of force and displacement.
        rotor_keeps: frame in which the rotor keeps its angle.
        chain: the model's planar chain where it has one; twice as fast.
        within: at that edge the foot joint is taken to be within its play.
    """
    top, directions = model.body("top").id, _directions(model, dofs, rotor_keeps)
    data.qvel[:] = 0
    pose = data.qpos.copy()
    leave_edge(model, data, 2 * _DIFFERENCE, within)
    if chain is not None:
        index = {int(dof): i for i, dof in enumerate(chain.dofs)}
        block = blocks_of(np.repeat(chain.links[None], LANES, axis=0))[0]
        found = stiffness_of_chain(
            block, chain.ground, chain.laws, chain.top, np.array(chain.gravity), chain.root,
            data.qpos, np.where(chain.dofs >= 0, directions[:, chain.dofs], 0.0),
            np.array([index[int(dof)] for dof in dofs]), _DIFFERENCE,
            chain.bodies[top], data.xfrc_applied[top, [0, 2]],
        )  # fmt: skip
        data.qpos[:] = pose
        return found
    here, columns = data.qpos.copy(), []
    for direction in directions:
        sides = []
        for step in (_DIFFERENCE, -_DIFFERENCE):
            mujoco.mj_integratePos(model, data.qpos, direction, step)
            sides.append(_static_force(model, data, top)[dofs])
            data.qpos[:] = here
        columns.append((sides[1] - sides[0]) / (2 * _DIFFERENCE))
    data.qpos[:] = pose
    return np.column_stack(columns)


def displace(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    dofs: NDArray[np.int_],
    by: NDArray[np.float64],
    rotor_keeps: RotorKeeps = "world",
) -> None:
    """Move some degrees of freedom; only the data's pose changes.

    Args:
        model: compiled.
        data: whose pose is moved.
        dofs: (n,) that are moved.
        by: (n,) how far [m, rad].
        rotor_keeps: its angle in the world, or against T.
    """
    velocity = np.zeros(model.nv)
    velocity[dofs] = by
    if rotor_keeps == "world":
        velocity[model.joint("rotor").dofadr[0]] -= np.sum(by[_is_rotation(model, dofs)])
    mujoco.mj_integratePos(model, data.qpos, velocity, 1.0)


def _directions(
    model: mujoco.MjModel, dofs: NDArray[np.int_], rotor_keeps: RotorKeeps
) -> NDArray[np.float64]:
    """Return the unit displacement of each of n degrees of freedom, (n, nv)."""
    units = np.zeros((dofs.size, model.nv))
    units[np.arange(dofs.size), dofs] = 1.0
    if rotor_keeps == "world":
        units[_is_rotation(model, dofs), model.joint("rotor").dofadr[0]] -= 1.0
    return units


def _is_rotation(model: mujoco.MjModel, dofs: NDArray[np.int_]) -> NDArray[np.bool_]:
    return dofs != _HEIGHT.get(int(model.jnt_type[0]), -1)
