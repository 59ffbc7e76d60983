"""The beam stiffens with its bend: a cubic term on every hinge but the foot joint.

torque = -k a - k3 a^3, a from the hinge's rest angle; MuJoCo's own stiffness polynomial.
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
            spec.joint(hinge_name(k)).stiffness[2] += values["k3"] / turn_share(robot, hinge) ** 3


EFFECT = Effect(
    name="hinge_cubic_stiffness",
    group="structure",
    sentence="the beam {k3:stiffens|softens} as it bends, with a cubic term of {k3} in every hinge",
    quantities=(Quantity("k3", "N m/rad^3", low=-2e3, high=2e4, tolerance=30.0, step=1.0),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("root_play", "hinge_quadratic_damping"),
    separated_by="ring-downs at three amplitudes: the frequency moves with amplitude squared",
    build=_build,
)
