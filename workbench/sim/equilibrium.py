"""The static equilibrium of the robot under gravity, where every simulated run starts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim.beam_laws import within_play
from workbench.sim.chain import PlanarChain
from workbench.sim.drive import Drive, hold_rotor
from workbench.sim.ground import CORNER_FIELDS, CORNERS
from workbench.sim.robot import Foot, Robot, chain_of, compile_model, hinge_name
from workbench.sim.statics import Balance, Statics, displace, moving_dofs, static_force

__all__ = [
    "FALLEN_M",
    "come_to_rest",
    "hinge_ids",
    "hold_top",
    "lift",
    "settle",
    "unloaded",
    "world_angle",
]

_ROUNDS = 60
_BALANCED = 1e-10  # [N, N m]
_LONGEST_STEP = 0.1  # [m, rad] of one round
_HELD_M = 1e-8  # tolerance of T's held position
_LOAD_ROUNDS = 3
_HANGING = np.pi / 2  # the rotor straight below T causes no moment
FALLEN_M = 0.05
"""Height of T below which the robot has fallen (thesis, Appendix E)."""


def unloaded(robot: Robot) -> Robot:
    """Return the robot with the rest angles of its free strip.

    For a shape listed as standing, every hinge's rest angle is its listed angle less the bend that
    gravity causes there: the torque by inverse dynamics of the motionless pose over stiffness.
    """
    if robot.state == "unloaded":
        return _drifted(robot)
    listed = replace(robot, increments=len(robot.angles), planar=False, state="unloaded")
    model = compile_model(listed, "free")
    data = mujoco.MjData(model)
    _pose(model, data, listed)
    data.joint("rotor").qpos[:] = _HANGING - world_angle(data)
    for _ in range(_LOAD_ROUNDS):
        mujoco.mj_forward(model, data)
        # the foot tips until its corners' springs carry the weight below the centre of mass
        lever = 4 * robot.values["ground_stiffness"] * (robot.values["foot_length"] / 2) ** 2
        weight = robot.values["gravity"] * float(model.body_mass.sum())
        pitch = weight * (data.subtree_com[1, 0] - data.qpos[0]) / lever
        data.qpos[3:7] = [np.cos(pitch / 2), 0, np.sin(pitch / 2), 0]
    data.qacc[:] = 0
    mujoco.mj_inverse(model, data)
    ids = hinge_ids(model, listed)
    bend = data.qfrc_inverse[model.jnt_dofadr[ids]] / model.jnt_stiffness[ids]
    angles = tuple(float(a + b) for a, b in zip(robot.angles, bend, strict=True))
    return _drifted(replace(robot, angles=angles, state="unloaded"))


def settle(
    robot: Robot,
    foot: Foot,
    start_angle: float,
    pull: tuple[float, float] = (0.0, 0.0),
    drive: Drive = "speed",
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return model and data at rest, of `come_to_rest`.

    Args:
        robot: with the angles of the free strip.
        foot: on the ground or fixed.
        start_angle: direction from T to the rotor in the world, about +y from +x [rad].
        pull: force on T, forward and up [N]; not in the data returned.
        drive: of the model's rotor.

    Raises:
        InputError: when the robot falls over or finds no rest.
    """
    model = compile_model(robot, foot, drive)
    data, chain = mujoco.MjData(model), chain_of(robot, foot, drive)
    come_to_rest(model, data, robot, foot, start_angle, pull, chain)
    return model, data


def come_to_rest(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    robot: Robot,
    foot: Foot,
    start_angle: float,
    pull: tuple[float, float] = (0.0, 0.0),
    chain: PlanarChain | None = None,
    near: NDArray[np.float64] | None = None,
) -> None:
    """Bring new data of a robot to rest, the rotor held at an angle.

    Newton's method on the static forces, the stiffness by central differences. Within the play of
    its foot joint, where the equilibrium is unstable, it follows the force instead. The equilibrium
    must be stable: its stiffness matrix positive definite.

    Args:
        model: of the robot.
        data: of the model, as it was reset.
        robot: with the angles of the free strip.
        foot: on the ground or fixed.
        start_angle: direction from T to the rotor in the world, about +y from +x [rad].
        pull: force on T, forward and up [N]; not in the data in the end.
        chain: the robot's planar chain where it has one.
        near: (nq,) pose to begin from [m, rad]; None takes the strip unbent.

    Raises:
        InputError: when the robot falls over or finds no rest.
    """
    if near is None:
        _pose(model, data, robot)
    else:
        data.qpos[:] = near
        mujoco.mj_kinematics(model, data)
    free = moving_dofs(model, foot)
    data.joint("rotor").qpos[:] += start_angle - world_angle(data)
    data.xfrc_applied[model.body("top").id, [0, 2]] = pull
    statics = Statics(model, data, free, chain=chain)
    here = statics.balance()
    for _ in range(_ROUNDS):
        if np.abs(here.force).max() < _BALANCED:
            break
        leaving = within_play(model, data)  # a hair within the edge its spring does not push back
        stiffness = statics.balance(within=True).stiffness if leaving else here.stiffness
        displace(model, data, free, _bounded(_towards_rest(stiffness, here.force, leaving)))
        here = statics.balance()
    _require_standing(here)
    data.xfrc_applied[:] = 0
    hold_rotor(model, data)
    _hold_on_slope(model, data, robot, foot)


def lift(model: mujoco.MjModel, data: mujoco.MjData, held: mujoco.MjData, height: float) -> None:
    """Lift a robot as if by hand, its foot level: the beam keeps the shape it has there.

    Args:
        model: of the robot, its foot free.
        data: of the model, changed in place.
        held: of the robot at rest with its foot fixed.
        height: of the foot above the ground [m].
    """
    feet = model.nq - held.qpos.size
    data.qpos[:feet] = 0
    data.qpos[feet:] = held.qpos
    data.qpos[1 if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_SLIDE else 2] = height
    if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE:
        data.qpos[3] = 1
    data.act[:] = held.act
    data.userdata[:] = 0
    mujoco.mj_forward(model, data)


def hold_top(
    model: mujoco.MjModel, data: mujoco.MjData, x: float, z: float, chain: PlanarChain | None = None
) -> NDArray[np.float64]:
    """Pull T to a position and return the force that holds it there, forward and up, (2,) [N].

    The foot is fixed. Newton's method on the static forces and the position at once:
    [K, -J'; J, 0] [dq; dF] = [force; target - T], J the derivative of T's x and z. The data's pose
    is the one held, without the force; the rotor keeps its angle in the world.

    Args:
        model: with its foot fixed.
        data: at rest without a pull; changed in place.
        x: where T is held, in the world [m].
        z: the same upward [m].
        chain: the robot's planar chain where it has one.

    Raises:
        InputError: when no force in this plane holds it there.
    """
    free, top = moving_dofs(model, "fixed"), model.body("top").id
    pull, statics = np.zeros(2), Statics(model, data, free, chain=chain)
    for _ in range(_ROUNDS):
        data.xfrc_applied[top, [0, 2]] = pull
        here = statics.balance()
        error = np.array([x, z]) - here.top
        if np.abs(here.force).max() < _BALANCED and np.abs(error).max() < _HELD_M:
            data.xfrc_applied[:] = 0
            hold_rotor(model, data)
            mujoco.mj_forward(model, data)
            return pull
        whole = np.block([[here.stiffness, -here.slopes.T], [here.slopes, np.zeros((2, 2))]])
        step = np.linalg.solve(whole, np.concatenate([here.force, error]))
        share = min(1.0, _LONGEST_STEP / max(float(np.abs(step[:-2]).max()), 1e-12))
        displace(model, data, free, np.asarray(share * step[:-2], dtype=np.float64))
        pull = pull + share * step[-2:]
    raise InputError(
        f"no force holds T at x = {x:.3f} m, z = {z:.3f} m of the foot's frame; check where T "
        "rested before the release, and the shape"
    )


def _drifted(robot: Robot) -> Robot:
    if not robot.drift:
        return robot
    angles = tuple(a + b for a, b in zip(robot.angles, robot.drift, strict=True))
    return replace(robot, angles=angles, drift=())


def _towards_rest(
    stiffness: NDArray[np.float64], force: NDArray[np.float64], leaving: bool
) -> NDArray[np.float64]:
    """Return Newton's step; to leave an unstable pose, reversed along the unstable directions."""
    if not leaving:
        return np.asarray(np.linalg.solve(stiffness, force), dtype=np.float64)
    values, directions = np.linalg.eigh((stiffness + stiffness.T) / 2)
    return np.asarray(directions @ ((directions.T @ force) / np.abs(values)), dtype=np.float64)


def _bounded(step: NDArray[Any]) -> NDArray[np.float64]:
    return step * min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))


def _require_standing(here: Balance) -> None:
    height, unbalanced = float(here.top[1]), float(np.abs(here.force).max())
    softest = float(np.linalg.eigvalsh((here.stiffness + here.stiffness.T) / 2).min())
    if unbalanced < _BALANCED and softest > 0 and height > FALLEN_M:
        return
    state = f"{unbalanced:.2g} N(m) unbalanced" if unbalanced >= _BALANCED else "it would topple"
    raise InputError(
        f"this robot does not stand: with T at z = {height:.3f} m it finds no rest ({state}); "
        "check the shape's angles, the stiffness and the masses"
    )


def _hold_on_slope(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, foot: Foot) -> None:
    """Put the foot at x = 0 and let its locked corners carry the weight along a slope."""
    if foot != "free":
        mujoco.mj_forward(model, data)
        return
    data.qpos[0] = 0
    down = static_force(model, data)[0]
    corners = data.userdata.reshape(CORNERS, len(CORNER_FIELDS))
    corners[:, CORNER_FIELDS.index("anchor_m")] -= down / CORNERS / robot.stick.stiffness
    mujoco.mj_forward(model, data)


def _pose(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot) -> None:
    angles = [hinge.angle for hinge in robot.hinges if hinge.stiffness is not None]
    data.qpos[model.jnt_qposadr[hinge_ids(model, robot)]] = angles
    mujoco.mj_forward(model, data)


def world_angle(data: mujoco.MjData) -> float:
    """Return the direction from T to the rotor in the world, about +y from +x [rad]."""
    arm = data.site("rotor").xpos - data.body("top").xpos
    return float(np.arctan2(-arm[2], arm[0]))


def hinge_ids(model: mujoco.MjModel, robot: Robot) -> NDArray[np.int_]:
    """Return the joints of the beam, (n,), in the order of its hinges."""
    bending = [k for k, hinge in enumerate(robot.hinges) if hinge.stiffness is not None]
    # the engine numbers joints by their bodies; a name for each costs a tenth of a start
    return model.joint(hinge_name(bending[0])).id + np.arange(len(bending))
