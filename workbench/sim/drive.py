"""Drives of the rotor against T (thesis, 3.3.4): by speed, torque or voltage.

A drive is a function that adds its actuators to the spec; each of them takes the command itself as
its control. A new drive is such a function, its name in `DRIVES` and its range in `LIMITS`.

Replay of a measured rotor angle is a speed as well: `command.replayed` makes it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import mujoco
import numpy as np

from workbench.errors import require_named
from workbench.sim.motor import MOTOR

__all__ = ["DRIVES", "LIMITS", "Drive", "Limit", "add_drive", "hold_rotor"]

Drive = Literal["speed", "torque", "voltage"]

AddDrive = Callable[[mujoco.MjSpec], None]

SERVO_STIFFNESS = 20.0
SERVO_DAMPING = 0.1
"""[N m/rad], [N m s/rad] that hold the rotor to its commanded angle: within about 1 mrad."""

_BRISTLE_STIFFNESS = 50.0
_BRISTLE_DAMPING = 0.05
"""[N m/rad], [N m s/rad] of static friction: it yields by 0.3 mrad before the rotor slides."""

# the rate of the servo's angle is the command, or the one of `droop_ripple`
_HAS_ANGLE = (mujoco.mjtDyn.mjDYN_INTEGRATOR, mujoco.mjtDyn.mjDYN_USER)


class Limit(NamedTuple):
    """The largest command of a drive, either way."""

    value: float
    unit: str


_HIGHEST_V = 6.0

LIMITS: dict[Drive, Limit] = {
    "speed": Limit(60.0, "rad/s"),
    "torque": Limit(MOTOR.holding_torque(_HIGHEST_V), "N m"),
    "voltage": Limit(_HIGHEST_V, "V"),
}
"""Beyond what the motor does: 60 rad/s is three times its speed at 5.5 V and a sample no longer
shows a turn well, 6 V is twice its nominal voltage, the torque is what stops it at 6 V."""


def add_drive(spec: mujoco.MjSpec, drive: Drive) -> None:
    """Add the actuators of a drive to a spec whose joint `rotor` turns the rotor against T."""
    require_named("drive", drive, DRIVES)
    DRIVES[drive](spec)


def hold_rotor(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Start a servo at the rotor's present angle; other drives have no such state."""
    servo = np.isin(model.actuator_dyntype, _HAS_ANGLE)
    data.act[model.actuator_actadr[servo]] = data.joint("rotor").qpos


def _add_servo(spec: mujoco.MjSpec) -> None:
    """Add a servo of the rotor against T, both controls its speed [rad/s].

    The first integrates its control and holds the rotor to that angle, the second to the speed: the
    rotor turns by exactly the commanded angle, as the motor of section 3.3.4 does.
    """
    fixed, affine = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    for name, gain, bias, dynamics in (
        ("rotor_angle", SERVO_STIFFNESS, [0, -SERVO_STIFFNESS, 0], "mjDYN_INTEGRATOR"),
        ("rotor_speed", SERVO_DAMPING, [0, 0, -SERVO_DAMPING], "mjDYN_NONE"),
    ):
        spec.add_actuator(
            name=name,
            target="rotor",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            dyntype=getattr(mujoco.mjtDyn, dynamics),
            gaintype=fixed,
            biastype=affine,
            gainprm=[gain] + [0] * 9,
            biasprm=bias + [0] * 7,
        )


def _add_torque(spec: mujoco.MjSpec) -> None:
    """Add a torque between T and rotor [N m]: no friction, no inertia but the rotor's."""
    spec.add_actuator(
        name="rotor_torque", target="rotor", trntype=mujoco.mjtTrn.mjTRN_JOINT
    ).set_to_motor()


def _add_motor(spec: mujoco.MjSpec) -> None:
    """Add the DC motor with its gearbox, its control the voltage at its terminals [V].

    At 0 V it is short-circuited, not disconnected, and brakes. MuJoCo knows one motor constant K,
    torque = K / R (U - K speed): K is the back-EMF behind the gear, and R is scaled so that K / R
    is right as well. Friction is MuJoCo's LuGre bristle with equal static and sliding friction.
    """
    constant = MOTOR.gear * MOTOR.back_emf
    gain = MOTOR.passed_on * MOTOR.torque_constant / MOTOR.resistance
    friction = MOTOR.passed_on * MOTOR.friction
    actuator = spec.add_actuator(
        name="rotor_voltage",
        target="rotor",
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        armature=MOTOR.gear**2 * MOTOR.armature,
    )
    actuator.set_to_dcmotor(
        motorconst=[constant, constant],
        resistance=constant / gain,
        lugre=[_BRISTLE_STIFFNESS, _BRISTLE_DAMPING, friction, friction, 1.0],
        ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_VOLTAGE),
    )


DRIVES: dict[Drive, AddDrive] = {"speed": _add_servo, "torque": _add_torque, "voltage": _add_motor}
"""Name of a drive -> function that adds it."""
