"""The rotor's unbalance M_R L_R is greater than the model says: its mass sits farther out.

The site that cameras see stays where it is.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "rotor_radius")


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    spec.site("rotor").pos[0] = robot.values["rotor_radius"] / (1 + values["share"])


EFFECT = Effect(
    name="rotor_unbalance",
    group="mass",
    sentence=(
        "the rotor's unbalance, mass times radius, is {share:greater|smaller} than the model "
        "says by {share:size}"
    ),
    quantities=(Quantity("share", "1", low=-0.9, high=2.0, tolerance=0.02, step=0.002),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_damping", "speed_ripple", "length_scale"),
    separated_by="weighing the rotor and balancing it on an edge; speeds well away from resonance",
    alter=_alter,
    build=_build,
)
