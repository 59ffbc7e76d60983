"""A robot at rest: its unbalanced force, and how that changes with the pose."""

from __future__ import annotations

from typing import Literal, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.sim.beam_laws import leave_edge
from workbench.sim.chain import PlanarChain
from workbench.sim.chain_links import LANES, blocks_of
from workbench.sim.chain_statics import balance_of_chain
from workbench.sim.robot import Foot

__all__ = ["Balance", "RotorKeeps", "Statics", "displace", "moving_dofs", "static_force"]

Array = NDArray[np.float64]

RotorKeeps = Literal["world", "top"]
"""Frame in which the rotor keeps its angle while the rest moves; locked to T it turns with T."""

_DIFFERENCE = 1e-6  # [m, rad]
# the one moving degree of freedom that is no rotation, by the type of the model's first joint
_HEIGHT = {int(mujoco.mjtJoint.mjJNT_FREE): 2, int(mujoco.mjtJoint.mjJNT_SLIDE): 1}


class Balance(NamedTuple):
    """What acts on some degrees of freedom at rest.

    Args:
        force: (n,) unbalanced [N, N m].
        stiffness: (n, n) minus its derivative [N, N m by m, rad].
        top: (2,) position of T, forward and up [m].
        slopes: (2, n) its derivative [m by m, rad].
    """

    force: Array
    stiffness: Array
    top: Array
    slopes: Array


class Statics:
    """The statics of a model at the poses of its data; the foot's corners lock where they are.

    Args:
        model: of the robot.
        data: whose pose and whose force on T are taken; it has no speed.
        dofs: (n,) degrees of freedom of force and displacement.
        rotor_keeps: frame in which the rotor keeps its angle.
        chain: the robot's planar chain where it has one, by whose numbers forces are computed, in a
            tenth of the engine's time.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        dofs: NDArray[np.int_],
        rotor_keeps: RotorKeeps = "world",
        chain: PlanarChain | None = None,
    ) -> None:
        self._model, self._data, self._dofs = model, data, dofs
        self._top, self._directions = model.body("top").id, _directions(model, dofs, rotor_keeps)
        data.qvel[:] = 0
        self._chain = chain
        if chain is None:
            return
        number = {int(dof): i for i, dof in enumerate(chain.dofs)}
        self._numbers = (
            blocks_of(np.repeat(chain.links[None], LANES, axis=0))[0],
            *(chain.ground, chain.laws, chain.top, np.array(chain.gravity), chain.root),
        )
        self._asked = (
            np.where(chain.dofs >= 0, self._directions[:, chain.dofs], 0.0),
            np.array([number[int(dof)] for dof in dofs]), _DIFFERENCE, chain.bodies[self._top],
        )  # fmt: skip

    def balance(self, within: bool = False) -> Balance:
        """Return what acts at the data's pose, its derivatives by central differences.

        At the edge of its play the foot joint is taken to be beyond it: differences across the edge
        would see half of its spring.

        Args:
            within: it is taken to be within its play.
        """
        data, pose = self._data, self._data.qpos.copy()
        leave_edge(self._model, data, 2 * _DIFFERENCE, within)
        if self._chain is not None:
            pull, around = data.xfrc_applied[self._top, [0, 2]], data.qpos.copy()
            data.qpos[:] = pose
            return Balance(*balance_of_chain(*self._numbers, pose, around, *self._asked, pull))
        stiffness = self._stiffness()
        data.qpos[:] = pose
        force, slopes = static_force(self._model, data)[self._dofs], np.empty((3, self._model.nv))
        place = data.xpos[self._top].copy()
        mujoco.mj_jac(self._model, data, slopes, None, place, self._top)
        return Balance(force, stiffness, place[[0, 2]], slopes[[0, 2]][:, self._dofs])

    def _stiffness(self) -> Array:
        model, data = self._model, self._data
        here, columns = data.qpos.copy(), []
        for direction in self._directions:
            sides = []
            for step in (_DIFFERENCE, -_DIFFERENCE):
                mujoco.mj_integratePos(model, data.qpos, direction, step)
                sides.append(static_force(model, data)[self._dofs])
                data.qpos[:] = here
            columns.append((sides[1] - sides[0]) / (2 * _DIFFERENCE))
        return np.column_stack(columns)


def static_force(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the unbalanced force at the data's pose, (nv,) [N, N m], by the engine."""
    data.qvel[:], data.userdata[:] = 0, 0
    mujoco.mj_forward(model, data)
    force, pulled, top = data.qfrc_passive - data.qfrc_bias, np.zeros(model.nv), data.body("top")
    pull = data.xfrc_applied[top.id, :3]
    mujoco.mj_applyFT(model, data, pull, np.zeros(3), top.xpos, top.id, pulled)
    return force + pulled


def moving_dofs(model: mujoco.MjModel, foot: Foot) -> NDArray[np.int_]:
    """Return the dofs that gravity moves, (n,): all but the rotor, of the foot z and pitch.

    The robot is symmetric sideways and about its vertical; the ground holds it forward.
    """
    rotor = model.joint("rotor").dofadr[0]
    held = {rotor}
    if foot == "free":
        held |= {0} if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_SLIDE else {0, 1, 3, 5}
    return np.array([dof for dof in range(model.nv) if dof not in held])


def displace(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    dofs: NDArray[np.int_],
    by: Array,
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
