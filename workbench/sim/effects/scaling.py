"""Scale model values, add to them, and scale a finer chain's hinges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.sim.beam import Hinge
from workbench.sim.robot import Robot

__all__ = ["added", "scaled", "turn_ratio"]


def scaled(robot: Robot, share: float, *names: str) -> Robot:
    """Return the robot with some model values larger by a share."""
    return replace(
        robot, values=dict(robot.values) | {n: robot.values[n] * (1 + share) for n in names}
    )


def added(robot: Robot, amount: float, name: str) -> Robot:
    """Return the robot with a model value larger by an amount, in its unit."""
    return replace(robot, values=dict(robot.values) | {name: robot.values[name] + amount})


def turn_ratio(robot: Robot, hinge: Hinge) -> float:
    """Return the turn of a hinge per turn of a listed one of the same beam [rad/rad].

    Args:
        robot: whose values are those of the listed chain.
        hinge: of its chain, not a rigid one.
    """
    return robot.values["hinge_stiffness"] / (hinge.stiffness or np.inf)
