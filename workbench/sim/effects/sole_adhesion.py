"""The sole sticks to the floor: each corner is pulled back until it tears off.

A corner that touched keeps its spring above the floor's level until that pulls by as much as it
can: fz = max(-pull, -k z - d z') up to z = pull / k instead of max(0, ...) up to z = 0. While it
pulls there is no friction.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.ground import extend_ground
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    extend_ground(spec, "adhesion", values["pull"])


EFFECT = Effect(
    name="sole_adhesion",
    group="ground",
    sentence="the sole sticks to the floor: every corner holds on by up to {pull} before it lifts",
    quantities=(Quantity("pull", "N", low=0.0, high=5.0, tolerance=0.02, step=0.002),),
    excited_by=("hop", "drop"),
    confused_with=("ground_damping", "ground_hunt_crossley"),
    separated_by="a slow pull upward on the foot; powder on the floor",
    build=_build,
)
