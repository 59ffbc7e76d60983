"""Checks of a robot and its command before the first step.

`require_valid` needs no model and runs first; `require_stable` checks the model at rest.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.schemas import UNITS, value_fault
from workbench.sim.condition import Condition
from workbench.sim.drive import DRIVES, LIMITS, Drive
from workbench.sim.robot import Robot

__all__ = ["MARGIN", "HighestMode", "highest_mode", "require_stable", "require_valid"]

MARGIN = 0.95
"""Share of the longest stable step that is allowed: the highest mode changes with the pose, and the
limit itself is accurate within 1.5 % (see `highest_mode`)."""


class HighestMode(NamedTuple):
    """The highest natural mode of the beam, which limits the time step.

    Args:
        omega: [rad/s].
        damping_ratio: of that mode.
    """

    omega: float
    damping_ratio: float

    @property
    def longest_step(self) -> float:
        """Return the step above which this mode grows [s].

        `implicitfast` takes the springs at the old position and the dampers at the new speed, so a
        mode obeys (1 + 2 zeta omega dt) v' = v - omega^2 dt x, which is stable up to
        omega dt = 2 zeta + 2 sqrt(1 + zeta^2).
        """
        zeta = self.damping_ratio
        return 2 * (zeta + np.sqrt(1 + zeta**2)) / self.omega


def require_valid(robot: Robot, condition: Condition) -> None:
    """Refuse values that no robot or motor can have.

    Raises:
        InputError: with name, value, unit and what is allowed.
    """
    _require_values(robot)
    _require_shape(robot)
    _require_finite_condition(robot, condition)
    _require_drive(condition.drive)
    _require_samples(condition.command)
    _require_finite_command(condition.drive, condition.command)
    _require_command_in_range(condition.drive, condition.command)


def require_stable(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Refuse a step in which the beam's highest mode would diverge.

    Raises:
        InputError: with the mode, the step and what to change.
    """
    mode, step = highest_mode(model, data), model.opt.timestep
    longest = MARGIN * mode.longest_step
    if step <= longest:
        return
    raise InputError(
        f"this robot cannot be simulated in steps of {1e3 * step:.3f} ms: its highest mode, "
        f"{mode.omega:.0f} rad/s with a damping ratio of {mode.damping_ratio:.2g}, allows at most "
        f"{1e3 * longest:.3f} ms; lower hinge_stiffness or root_stiffness, raise hinge_damping, "
        "take fewer increments or a shorter step"
    )


def highest_mode(model: mujoco.MjModel, data: mujoco.MjData) -> HighestMode:
    """Return the highest mode of the hinges, from M^-1 K at the present pose.

    The thesis' robot: 9029 rad/s, damping ratio 1.44, so steps up to 0.706 ms. Measured by trying
    steps until it blew up: 0.703 ms; without damping 0.221 ms where 0.222 ms is expected; with
    hinges 16 times as stiff 0.0784 ms where 0.0786 ms is.
    """
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    stiffness = np.zeros(model.nv)
    hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    stiffness[model.jnt_dofadr[hinges]] = model.jnt_stiffness[hinges]
    squares, shapes = scipy.linalg.eigh(np.diag(stiffness), mass)
    omega, shape = float(np.sqrt(squares[-1])), shapes[:, -1]  # shape M shape = 1
    return HighestMode(omega, float(shape**2 @ model.dof_damping) / (2 * omega))


def _require_values(robot: Robot) -> None:
    for name, value in robot.values.items():
        wanted = value_fault(name, value)
        if wanted is not None:
            unit = UNITS.get(name, "(SI)")
            raise InputError(f"parameter {name} is {value:g} {unit}; it must be {wanted}")


def _require_shape(robot: Robot) -> None:
    for k, angle in enumerate(robot.angles):
        if not np.isfinite(angle):
            raise InputError(f"angle alpha_{k} is {angle:g} rad; it must be a number")
    if not (np.isfinite(robot.length) and robot.length > 0):
        raise InputError(f"the beam's length is {robot.length:g} m; it must be above 0 m")


def _require_finite_condition(robot: Robot, condition: Condition) -> None:
    for name, value, unit in (
        ("the floor's slope", robot.slope, "rad"),
        ("the rotor's start angle", condition.start_angle, "rad"),
        ("the still time", condition.rest, "s"),
        ("the pull on T", condition.pull, "N"),
        ("the upward pull on T", condition.pull_up, "N"),
        ("the height of the fall", condition.height, "m"),
    ):
        if not np.isfinite(value):
            raise InputError(f"{name} is {value:g} {unit}; it must be a number")


def _require_drive(drive: Drive) -> None:
    if drive not in DRIVES:
        raise InputError(f"no drive {drive!r}; drives that exist: {', '.join(DRIVES)}")


def _require_samples(command: NDArray[np.float64]) -> None:
    if np.ndim(command) != 1 or not len(command):
        raise InputError(
            f"the command has shape {np.shape(command)}; it must be one row of at least one sample"
        )


def _require_finite_command(drive: Drive, command: NDArray[np.float64]) -> None:
    wrong = np.flatnonzero(~np.isfinite(command))
    if len(wrong):
        raise InputError(
            f"{drive} is {command[wrong[0]]:g} {LIMITS[drive].unit} at sample {wrong[0]}; "
            "every sample must be a number"
        )


def _require_command_in_range(drive: Drive, command: NDArray[np.float64]) -> None:
    value, unit = LIMITS[drive]
    wrong = np.flatnonzero(np.abs(command) > value)
    if len(wrong):
        raise InputError(
            f"{drive} {command[wrong[0]]:g} {unit} at sample {wrong[0]} is outside "
            f"-{value:g} to {value:g} {unit}"
        )
