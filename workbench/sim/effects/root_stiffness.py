"""The foot joint is stiffer or softer than the model says."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "root_stiffness")


EFFECT = Effect(
    name="root_stiffness",
    group="structure",
    sentence=(
        "the joint of beam and foot is {share:stiffer|softer} than the model says by {share:size}"
    ),
    quantities=(Quantity("share", "1", low=-0.9, high=9.0, tolerance=0.1, step=2e-3),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "local_stiffness_loss", "beam_discretisation"),
    separated_by="a marker where the beam leaves the foot; the ratio of the two lowest frequencies",
    alter=_alter,
)
