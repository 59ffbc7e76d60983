"""The beam is stiffer or softer than the model says, all hinges alike."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "hinge_stiffness")


EFFECT = Effect(
    name="hinge_stiffness",
    group="structure",
    sentence="the beam's hinges are {share:stiffer|softer} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-0.9, high=9.0, tolerance=0.1, step=5e-4),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=(
        "root_stiffness",
        "local_stiffness_loss",
        "top_mass",
        "beam_discretisation",
        "length_scale",
    ),
    separated_by="the ratio of the two lowest frequencies; weighing",
    alter=_alter,
)
