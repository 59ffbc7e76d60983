"""Dry friction in every hinge but the foot joint: a torque that does not depend on speed.

MuJoCo's own friction loss. The moment is the same in a finer chain, so is the torque at which it
gives way.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot, hinge_name

__all__ = ["EFFECT"]


_STIFF = [0.9999, 0.9999, 0.001, 0.5, 2]
"""Impedance, the engine's greatest: a hinge at rest creeps by 1e-4 of what it would without."""
_QUICK = [0.002, 1]
"""Time constant [s] and damping ratio with which a hinge comes to rest. At ten times that a tenth
of the energy is not taken, at a quarter of it a robot at rest trembles by micrometres."""


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)  # contacts stay off
    for k, hinge in enumerate(robot.hinges[1:], start=1):
        if hinge.stiffness is not None:
            joint = spec.joint(hinge_name(k))
            joint.frictionloss = values["torque"]
            joint.solimp_friction, joint.solref_friction = _STIFF, _QUICK


EFFECT = Effect(
    name="hinge_coulomb_friction",
    group="dissipation",
    sentence="dry friction of {torque} in every hinge of the beam",
    quantities=(Quantity("torque", "N m", low=0.0, high=0.1, tolerance=0.0001, step=1e-05),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_quadratic_damping", "hinge_damping", "root_play"),
    separated_by="a ring-down to the end: it fades along a straight line; a slow pull and return",
    build=_build,
    dear=True,
)
