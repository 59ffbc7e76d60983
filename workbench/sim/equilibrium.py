"""The robot at rest under gravity: where every simulated run starts."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim.ground import CORNER_FIELDS, CORNERS
from workbench.sim.robot import Robot, compile_model, hinge_name

__all__ = ["FALLEN_M", "settle", "unloaded"]

_SETTLE_S = 6.0
_SETTLE_DAMPING = 2.0  # [N m s/rad] near critical for the beam's first mode, 8 rad/s on 9.5 N m/rad
_STILL = 1e-6  # [m/s, rad/s]
_ANGLE_TOLERANCE = 1e-4  # [rad]
_ANGLE_ROUNDS = 4
_LOAD_ROUNDS = 3
_HANGING = np.pi / 2  # the rotor straight below T loads no hinge with a moment of its own
FALLEN_M = 0.05
"""Height of T below which the robot has fallen (thesis, Appendix E)."""


def unloaded(robot: Robot) -> Robot:
    """Return the robot with the rest angles of its free strip.

    For a shape listed as standing, every hinge's rest angle is its listed angle less the bend that
    gravity causes there: the torque by inverse dynamics of the motionless pose over stiffness.
    """
    if robot.state == "unloaded":
        return robot
    model = compile_model(robot, "hop")
    data = mujoco.MjData(model)
    _pose(model, data, robot.angles)
    data.joint("rotor").qpos[:] = _HANGING - _world_angle(data)
    hinges = _hinge_dofs(model, robot)
    for _ in range(_LOAD_ROUNDS):
        mujoco.mj_forward(model, data)
        # the foot tips until its corners' springs carry the weight below the centre of mass
        lever = 4 * robot.values["ground_stiffness"] * (robot.values["foot_length"] / 2) ** 2
        weight = robot.values["gravity"] * float(model.body_mass.sum())
        pitch = weight * (data.subtree_com[1, 0] - data.qpos[0]) / lever
        data.qpos[3:7] = [np.cos(pitch / 2), 0, np.sin(pitch / 2), 0]
    data.qacc[:] = 0
    mujoco.mj_inverse(model, data)
    bend = data.qfrc_inverse[hinges] / model.jnt_stiffness[_hinge_ids(model, robot)]
    return replace(
        robot,
        angles=tuple(float(a + b) for a, b in zip(robot.angles, bend, strict=True)),
        state="unloaded",
    )


def settle(
    robot: Robot, mode: Literal["hop", "clamped"], start_angle: float
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return model and data at rest, the rotor held at an angle.

    The damped motion is followed until it stops; what remains is the equilibrium, with every corner
    of the foot locked where it stands.

    Args:
        robot: with the angles of the free strip.
        mode: foot on the ground or fixed.
        start_angle: direction from T to the rotor in the world, about +y from +x [rad].

    Raises:
        InputError: when the robot falls over or finds no rest.
    """
    model = compile_model(robot, mode)
    damped = compile_model(robot, mode)
    damped.dof_damping[_hinge_dofs(damped, robot)] = _SETTLE_DAMPING
    data = mujoco.MjData(model)
    _pose(model, data, robot.angles)
    for _ in range(_ANGLE_ROUNDS):
        joint = float(data.joint("rotor").qpos[0]) + _wrapped(start_angle - _world_angle(data))
        _relax(damped, data, joint)
        if abs(_wrapped(start_angle - _world_angle(data))) < _ANGLE_TOLERANCE:
            break
    if mode == "hop":
        _centre(data)
    return model, data


def _relax(damped: mujoco.MjModel, data: mujoco.MjData, joint: float) -> None:
    data.joint("rotor").qpos[:] = joint
    data.ctrl[:] = [joint, 0]
    mujoco.mj_step(damped, data, nstep=round(_SETTLE_S / damped.opt.timestep))
    fastest, height = np.abs(data.qvel).max(), data.body("top").xpos[2]
    if not fastest < _STILL or height < FALLEN_M:
        raise InputError(
            f"this robot does not stand: after {_SETTLE_S:g} s T is at z = {height:.3f} m and "
            f"moves at {fastest:.2g} rad/s; check the shape's angles, the stiffness and the masses"
        )
    data.qvel[:] = 0


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def _pose(model: mujoco.MjModel, data: mujoco.MjData, angles: tuple[float, ...]) -> None:
    for k, angle in enumerate(angles):
        data.joint(hinge_name(k)).qpos[:] = angle
    mujoco.mj_forward(model, data)


def _world_angle(data: mujoco.MjData) -> float:
    arm = data.site("rotor").xpos - data.body("top").xpos
    return float(np.arctan2(-arm[2], arm[0]))


def _centre(data: mujoco.MjData) -> None:
    """Move the robot so that its foot stands at x = 0, with the corners' anchors."""
    shift = float(data.qpos[0])
    data.qpos[0] -= shift
    corners = data.userdata.reshape(CORNERS, len(CORNER_FIELDS))
    corners[:, CORNER_FIELDS.index("anchor_m")] -= shift


def _hinge_ids(model: mujoco.MjModel, robot: Robot) -> NDArray[np.int_]:
    return np.array([model.joint(hinge_name(k)).id for k in range(robot.increments)])


def _hinge_dofs(model: mujoco.MjModel, robot: Robot) -> NDArray[np.int_]:
    return model.jnt_dofadr[_hinge_ids(model, robot)]
