"""Apply effects to a robot, to its command, and to the motion that cameras see."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import mujoco

from workbench.sim.condition import Condition
from workbench.sim.effects.effect import Build, Effect, Values
from workbench.sim.effects.library import EFFECTS, effect_values
from workbench.sim.robot import Robot
from workbench.timeseries import TimeSeries

__all__ = ["applied", "driven", "observed"]


def applied(robot: Robot, turning: bool = True) -> Robot:
    """Return the robot with its effects applied to its parameters and MjSpec.

    Args:
        robot: with effects.
        turning: whether its motor is on; effects of the drive are left out where it is off.

    Raises:
        InputError: for an unknown effect or quantity.
    """
    changed = robot
    for effect, values in _effects(robot):
        if effect.alter is not None:
            changed = effect.alter(changed, values)
        if effect.build is not None and (turning or effect.group != "drive"):
            changed = replace(changed, edits=(*changed.edits, _Edit(effect.build, values)))
    return replace(changed, effects={})


def driven(condition: Condition, robot: Robot) -> Condition:
    """Return a condition with the effects of the drive on its command."""
    for effect, values in _effects(robot):
        if effect.drive is not None:
            condition = effect.drive(condition, values)
    return condition


def observed(motion: TimeSeries, robot: Robot) -> TimeSeries:
    """Return a motion as the cameras see it."""
    for effect, values in _effects(robot):
        if effect.observe is not None:
            motion = effect.observe(motion, values)
    return motion


@dataclass(frozen=True)
class _Edit:
    """An effect's change of the MjSpec; equal to another of the same effect and values."""

    build: Build
    values: Values

    def __call__(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        self.build(spec, robot, self.values)

    def __hash__(self) -> int:
        return hash((self.build, frozenset(self.values.items())))


def _effects(robot: Robot) -> Iterator[tuple[Effect, dict[str, float]]]:
    """Yield the effects that are not zero, in the library's order."""
    given = {name: effect_values(name, values) for name, values in robot.effects.items()}
    for name, effect in EFFECTS.items():
        if any(given.get(name, {}).values()):
            yield effect, given[name]
