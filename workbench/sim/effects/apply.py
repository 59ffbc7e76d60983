"""Put effects into a robot, into what drives it, and into what is seen of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from workbench.sim.condition import Condition
from workbench.sim.effects.effect import Build, Effect, Values
from workbench.sim.effects.library import EFFECTS, effect_values
from workbench.sim.robot import Edit, Robot
from workbench.timeseries import TimeSeries

__all__ = ["applied", "driven", "observed"]


def applied(robot: Robot, turning: bool = True) -> Robot:
    """Return the robot with what its effects change of numbers and MjSpec; none are left to apply.

    Args:
        robot: with effects.
        turning: whether its motor is on; one that is off has no effects of a drive.

    Raises:
        InputError: for an unknown effect or quantity.
    """
    changed = robot
    for effect, values in _effects(robot):
        if effect.alter is not None:
            changed = effect.alter(changed, values)
        if effect.build is not None and (turning or effect.group != "drive"):
            changed = replace(changed, edits=(*changed.edits, _edit(effect.build, values)))
    return replace(changed, effects={})


def driven(condition: Condition, robot: Robot) -> Condition:
    """Return what the motor makes of a condition."""
    for effect, values in _effects(robot):
        if effect.drive is not None:
            condition = effect.drive(condition, values)
    return condition


def observed(motion: TimeSeries, robot: Robot) -> TimeSeries:
    """Return what the cameras make of a motion."""
    for effect, values in _effects(robot):
        if effect.observe is not None:
            motion = effect.observe(motion, values)
    return motion


def _edit(build: Build, values: Values) -> Edit:
    return lambda spec, robot: build(spec, robot, values)


def _effects(robot: Robot) -> Iterator[tuple[Effect, dict[str, float]]]:
    """Yield the effects that are there, in the library's order whatever the robot's is."""
    given = {name: effect_values(name, values) for name, values in robot.effects.items()}
    for name, effect in EFFECTS.items():
        if any(given.get(name, {}).values()):
            yield effect, given[name]
