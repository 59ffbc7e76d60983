"""The foot's centre of gravity is not at its centre; shows only when the foot moves."""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    spec.body("foot").ipos[0] += values["forward"]


EFFECT = Effect(
    name="foot_cg",
    group="mass",
    sentence=(
        "the foot's centre of gravity lies {forward:forward|backward} of its centre by "
        "{forward:size}"
    ),
    quantities=(Quantity("forward", "m", low=-0.13, high=0.13, tolerance=0.003, step=0.0003),),
    excited_by=("hop", "drop"),
    confused_with=("foot_mass", "ground_slope", "marker_offset"),
    separated_by="balancing the foot on an edge",
    build=_build,
)
