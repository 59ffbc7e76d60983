"""Effects of the drive: how the rotor's speed differs from the command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.sim.condition import Condition
from workbench.sim.droop_ripple import add_droop, add_ripple
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import SAMPLE_RATE_HZ

__all__ = ["EFFECTS"]

SPEED_SCALE = Effect(
    name="speed_scale",
    group="drive",
    sentence="the motor turns {share:faster|slower} than commanded by {share:size}",
    quantities=(Quantity("share", "1", low=-0.5, high=0.5, tolerance=0.005, step=1e-5),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_offset", "motor_droop", "speed_drift", "time_offset"),
    separated_by="several speeds: a share grows with the speed, an offset does not",
    drive=lambda condition, values: replace(
        condition, command=condition.command * (1 + values["share"])
    ),
)
"""The motor turns faster than commanded by a share: the slope of its line is off."""


def _speed_offset(condition: Condition, values: Values) -> Condition:
    faster = values["offset"] * np.sign(condition.command)  # a motor that is off stays off
    return replace(condition, command=condition.command + faster)


SPEED_OFFSET = Effect(
    name="speed_offset",
    group="drive",
    sentence=(
        "the motor turns {offset:faster|slower} than commanded by {offset:size} at every speed"
    ),
    quantities=(Quantity("offset", "rad/s", low=-10, high=10, tolerance=0.1, step=1e-4),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_scale", "motor_droop", "speed_drift", "time_offset"),
    separated_by="several speeds: a share grows with the speed, an offset does not",
    drive=_speed_offset,
)
"""The motor turns faster than commanded by a constant: the line's intercept is off."""


def _speed_drift(condition: Condition, values: Values) -> Condition:
    held = (np.arange(len(condition.command)) + 0.5) / SAMPLE_RATE_HZ  # middle of each command
    return replace(condition, command=condition.command * (1 + values["rate"] * held))


SPEED_DRIFT = Effect(
    name="speed_drift",
    group="drive",
    sentence=(
        "the motor's speed {rate:rises|falls} during a run by {rate:size} of the commanded one"
    ),
    quantities=(Quantity("rate", "1/s", low=-0.05, high=0.05, tolerance=3e-4, step=1e-6),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_scale", "speed_offset", "motor_droop"),
    separated_by="a long run at one speed; the order of runs changed, or a pause to cool",
    drive=_speed_drift,
)
"""The motor's speed drifts during a run: it warms up or its battery runs down."""

MOTOR_DROOP = Effect(
    name="motor_droop",
    group="drive",
    sentence="the motor turns slower under load by {slope}",
    quantities=(Quantity("slope", "rad/s per N m", low=0, high=500, tolerance=10.0, step=0.01),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_ripple", "speed_scale", "speed_offset", "speed_drift"),
    separated_by="the rotor's own speed, within a turn and near the resonance where it loads most",
    build=lambda spec, _, values: add_droop(spec, values["slope"]),
)
"""The motor turns slower under load: its line falls with the torque that it gives."""

_SHARES = ("cos_1", "sin_1", "cos_2", "sin_2")

SPEED_RIPPLE = Effect(
    name="speed_ripple",
    group="drive",
    sentence="the rotor's speed varies within a turn: once by {cos_1} (cosine) and {sin_1} (sine) "
    "of it, twice by {cos_2} and {sin_2}",
    quantities=tuple(
        Quantity(name, "1", low=-0.4, high=0.4, tolerance=0.01, step=1e-5) for name in _SHARES
    ),
    excited_by=("clamped", "hop"),
    confused_with=("motor_droop", "rotor_unbalance", "marker_offset"),
    separated_by="the axis turned upright: what the weight does is gone, what gears do stays",
    build=lambda spec, _, values: add_ripple(spec, [values[name] for name in _SHARES]),
)
"""The rotor turns unevenly within a turn: a bent shaft, eccentric gears, a weight on one side.

speed = command (1 + cos_1 cos p + sin_1 sin p + cos_2 cos 2p + sin_2 sin 2p), p the rotor's angle
in the world about +y from +x. The second order is that of an oval gear or of two shafts askew.
"""

EFFECTS = (SPEED_SCALE, SPEED_OFFSET, SPEED_DRIFT, MOTOR_DROOP, SPEED_RIPPLE)
