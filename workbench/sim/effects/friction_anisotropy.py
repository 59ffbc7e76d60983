"""The sole's friction depends on the direction: higher forward, lower backward.

Both coefficients are 1 + share times as high against a motion forward, 1 - share times against one
backward.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.ground import extend_ground
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    extend_ground(spec, "anisotropy", values["share"])


EFFECT = Effect(
    name="friction_anisotropy",
    group="ground",
    sentence=(
        "the sole's friction is {share:higher|lower} forward by {share:size}, and "
        "{share:lower|higher} backward by as much"
    ),
    quantities=(Quantity("share", "1", low=-0.9, high=0.9, tolerance=0.1, step=0.001),),
    excited_by=("hop", "drop"),
    confused_with=("friction_level", "ground_slope"),
    separated_by="a slow pull on the foot both ways; the robot turned round on the same floor",
    build=_build,
)
