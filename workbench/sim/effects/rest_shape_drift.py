"""The strip took a set since its shape was listed: its rest angles changed for good.

`root` is the angle of the foot joint, `bend` is spread evenly over the other hinges. A shape that
was listed standing drifts as well: the change is that of the free strip.
"""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    others = len(robot.angles) - 1
    before = robot.drift or (0.0,) * len(robot.angles)
    change = (values["root"],) + (values["bend"] / others,) * others
    return replace(robot, drift=tuple(a + b for a, b in zip(before, change, strict=True)))


EFFECT = Effect(
    name="rest_shape_drift",
    group="structure",
    sentence="the strip took a set: its root turned by {root}, the rest bent by {bend} in all",
    quantities=(
        Quantity("root", "rad", low=-0.5, high=0.5, tolerance=0.005, step=0.0005),
        Quantity("bend", "rad", low=-0.5, high=0.5, tolerance=0.02, step=5e-4),
    ),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=(
        "ground_slope",
        "camera_tilt",
        "tether",
        "root_play",
        "local_stiffness_loss",
        "marker_offset",
    ),
    separated_by="the free strip on its template before and after; a run in the opposite direction",
    alter=_alter,
)
