"""A part of the beam lost stiffness: a crack, a kink, a burnt spot.

Each third of the strip has its own loss, so that the place shows in a linear screening; a loss
smeared over two thirds lies across their border. Damping stays. Negative where it is stiffer.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot, hinge_name

__all__ = ["EFFECT"]


PARTS = ("near_foot", "middle", "near_top")


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    softer = np.array([values[part] / (1 - values[part]) for part in PARTS])
    for k, hinge in enumerate(robot.hinges):
        if hinge.stiffness is None:
            continue
        yielding = (
            1 / hinge.stiffness + _covered(robot, k) @ softer / robot.values["hinge_stiffness"]
        )
        spec.joint(hinge_name(k)).stiffness[0] = 1 / yielding


def _covered(robot: Robot, k: int) -> NDArray[np.float64]:
    """Return how much of each third the hinge of a chain stands for, in listed increments, (3,).

    The listed hinges, and the strip that bends, reach from half an increment to half an increment
    before the end (`beam`).
    """
    listed = len(robot.angles)
    cell = listed / robot.increments
    edges = np.linspace(0.5, listed - 0.5, len(PARTS) + 1)
    inside = np.clip(
        [max(k - 0.5, 0.0) * cell, (k + 0.5) * cell], edges[:-1, None], edges[1:, None]
    )
    return inside[:, 1] - inside[:, 0]


EFFECT = Effect(
    name="local_stiffness_loss",
    group="structure",
    sentence=(
        "the beam lost stiffness: {near_foot} in the third near the foot, {middle} in the middle, "
        "{near_top} near the top"
    ),
    quantities=(
        Quantity("near_foot", "1", low=-1.0, high=0.95, tolerance=0.05, step=5e-4),
        Quantity("middle", "1", low=-1.0, high=0.95, tolerance=0.05, step=5e-4),
        Quantity("near_top", "1", low=-1.0, high=0.95, tolerance=0.05, step=5e-4),
    ),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "root_stiffness", "rest_shape_drift"),
    separated_by="the ratio of the two lowest frequencies; the beam's shape with a mass hung on T",
    build=_build,
)
