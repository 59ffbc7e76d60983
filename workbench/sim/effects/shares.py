"""Change model values by a share."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.robot import Robot

__all__ = ["scaled"]


def scaled(robot: Robot, share: float, *names: str) -> Robot:
    """Return the robot with some model values larger by a share."""
    values = dict(robot.values)
    for name in names:
        values[name] *= 1 + share
    return replace(robot, values=values)
