"""The strip's damping grows with its speed: a quadratic term on every hinge but the foot joint.

torque = -d w - c w |w|, w the hinge's speed; MuJoCo's own damping polynomial.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import turn_share
from workbench.sim.robot import Robot, hinge_name

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    for k, hinge in enumerate(robot.hinges[1:], start=1):
        if hinge.stiffness is not None:
            spec.joint(hinge_name(k)).damping[1] += values["c"] / turn_share(robot, hinge) ** 2


EFFECT = Effect(
    name="hinge_quadratic_damping",
    group="dissipation",
    sentence="the beam damps more the faster it bends, with a quadratic term of {c} in every hinge",
    quantities=(Quantity("c", "N m s^2/rad^2", low=0.0, high=1.0, tolerance=0.003, step=1e-4),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_coulomb_friction", "hinge_damping", "air_drag", "hinge_cubic_stiffness"),
    separated_by="ring-downs at three amplitudes: the decay rate grows with the amplitude",
    build=_build,
)
