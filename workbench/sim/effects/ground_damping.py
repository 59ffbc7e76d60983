"""The ground damps more or less than the model says, at all corners."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "ground_damping")


EFFECT = Effect(
    name="ground_damping",
    group="ground",
    sentence="the ground damps {share:more|less} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-1.0, high=5.0, tolerance=0.3, step=0.03),),
    excited_by=("hop", "drop"),
    confused_with=(
        "ground_stiffness",
        "ground_hunt_crossley",
        "sole_adhesion",
        "foot_mass",
        "time_step",
    ),
    separated_by="drops from three heights",
    alter=_alter,
)
