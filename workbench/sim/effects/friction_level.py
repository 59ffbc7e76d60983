"""The sole's friction is higher or lower than the model says, sliding and sticking alike."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "friction_slide", "friction_stick")


EFFECT = Effect(
    name="friction_level",
    group="ground",
    sentence="the sole's friction is {share:higher|lower} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-0.95, high=4.0, tolerance=0.2, step=0.002),),
    excited_by=("hop", "drop"),
    confused_with=("friction_anisotropy", "ground_slope"),
    separated_by="a slow pull on the foot; the slope at which the robot slides",
    alter=_alter,
)
