"""The engine's step is too long: the simulation itself errs."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return replace(robot, steps_per_sample=robot.steps_per_sample * 2 ** round(values["halvings"]))


EFFECT = Effect(
    name="time_step",
    group="numerics",
    sentence="the simulation's time step is too long: it takes {halvings} halvings of it",
    quantities=(Quantity("halvings", "1", low=0, high=2, tolerance=1, step=1),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_damping", "ground_damping"),
    separated_by="simulating with a shorter step, which costs no experiment",
    alter=_alter,
    dear=True,
)
