"""Something weighs on T that the model does not know: a screw, a cable, a marker plate."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import added
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return added(robot, values["mass"], "top_mass")


EFFECT = Effect(
    name="top_mass",
    group="mass",
    sentence="the top is {mass:heavier|lighter} than the model says by {mass:size}",
    quantities=(Quantity("mass", "kg", low=-0.08, high=0.5, tolerance=0.002, step=5e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "length_scale"),
    separated_by="weighing; a known mass added on T",
    alter=_alter,
)
