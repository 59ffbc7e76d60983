"""The motor turns slower under load: its line falls with the torque that it gives."""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot
from workbench.sim.uneven import let_droop

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    let_droop(spec, values["slope"])


EFFECT = Effect(
    name="motor_droop",
    group="drive",
    sentence="the motor turns slower under load by {slope}",
    quantities=(Quantity("slope", "rad/s per N m", low=0, high=500, tolerance=10.0, step=0.01),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_ripple", "speed_scale", "speed_offset", "speed_drift"),
    separated_by="the rotor's own speed, within a turn and near the resonance where it loads most",
    build=_build,
)
