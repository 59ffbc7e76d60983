"""The ground's damping grows with the depth, as Hunt and Crossley's does.

fz = -k z - (d + lambda |z|) z' at each corner: no step of the force at touch-down from this term.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.ground import extend_ground
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    extend_ground(spec, "depth_damping", values["depth_damping"])


EFFECT = Effect(
    name="ground_hunt_crossley",
    group="ground",
    sentence="the ground's damping grows with the depth, by {depth_damping} at every corner",
    quantities=(
        Quantity("depth_damping", "N s/m^2", low=0.0, high=20000.0, tolerance=500.0, step=50.0),
    ),
    excited_by=("hop", "drop"),
    confused_with=("ground_stiffness", "ground_damping", "sole_adhesion"),
    separated_by="drops from three heights: the term acts with the depth, so more in high falls",
    build=_build,
)
