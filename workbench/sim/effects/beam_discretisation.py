"""The strip is finer than the model's chain: the simulated beam has too few increments."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return replace(robot, increments=robot.increments + round(values["more"]))


EFFECT = Effect(
    name="beam_discretisation",
    group="numerics",
    sentence="the simulated beam has too few increments: it takes {more} more of them",
    quantities=(Quantity("more", "1", low=0, high=48, tolerance=16, step=1),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "root_stiffness"),
    separated_by="simulating with more increments, which costs no experiment",
    alter=_alter,
    dear=True,
)
