"""The foot is heavier or lighter than the model says."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import added
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return added(robot, values["mass"], "foot_mass")


EFFECT = Effect(
    name="foot_mass",
    group="mass",
    sentence="the foot is {mass:heavier|lighter} than the model says by {mass:size}",
    quantities=(Quantity("mass", "kg", low=-0.07, high=0.5, tolerance=0.002, step=0.0002),),
    excited_by=("hop", "drop"),
    confused_with=("foot_cg", "ground_stiffness", "ground_damping"),
    separated_by="weighing",
    alter=_alter,
)
