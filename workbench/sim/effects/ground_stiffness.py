"""The ground is stiffer or softer upward than the model says, at all corners."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "ground_stiffness")


EFFECT = Effect(
    name="ground_stiffness",
    group="ground",
    sentence="the ground is {share:stiffer|softer} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-0.9, high=10.0, tolerance=0.3, step=0.03),),
    excited_by=("hop", "drop"),
    confused_with=("ground_damping", "ground_hunt_crossley", "foot_mass"),
    separated_by="how deep the foot sinks at rest; drops from three heights",
    alter=_alter,
)
