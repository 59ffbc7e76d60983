"""The floor rises forward; axes stay along the floor."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return replace(robot, slope=robot.slope + values["slope"])


EFFECT = Effect(
    name="ground_slope",
    group="ground",
    sentence="the floor {slope:rises|falls} forward by {slope:size}",
    quantities=(Quantity("slope", "rad", low=-0.2, high=0.2, tolerance=0.005, step=0.0005),),
    excited_by=("hop", "drop", "clamped", "decay"),
    confused_with=(
        "camera_tilt",
        "rest_shape_drift",
        "foot_cg",
        "friction_level",
        "friction_anisotropy",
        "tether",
    ),
    separated_by="the same run in the opposite direction: a slope changes its sign",
    alter=_alter,
)
