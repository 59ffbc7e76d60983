"""Effects of numerics: discretisation errors of the simulation."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot

__all__ = ["EFFECTS"]

BEAM_DISCRETISATION = Effect(
    name="beam_discretisation",
    group="numerics",
    sentence="the simulated beam has too few increments: it takes {more} more of them",
    quantities=(Quantity("more", "1", low=0, high=48, tolerance=16, step=1),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "root_stiffness"),
    separated_by="simulating with more increments, which costs no experiment",
    alter=lambda robot, values: replace(robot, increments=robot.increments + round(values["more"])),
)
"""The strip is finer than the model's chain: the simulated beam has too few increments."""


def _time_step(robot: Robot, values: Values) -> Robot:
    return replace(robot, steps_per_sample=robot.steps_per_sample * 2 ** round(values["halvings"]))


TIME_STEP = Effect(
    name="time_step",
    group="numerics",
    sentence="the simulation's time step is too long: it takes {halvings} halvings of it",
    quantities=(Quantity("halvings", "1", low=0, high=2, tolerance=1, step=1),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_damping", "ground_damping"),
    separated_by="simulating with a shorter step, which costs no experiment",
    alter=_time_step,
)
"""The engine's step is too long: an integration error."""

EFFECTS = (BEAM_DISCRETISATION, TIME_STEP)
