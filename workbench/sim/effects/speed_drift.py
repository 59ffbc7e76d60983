"""The motor's speed drifts during a run: it warms up or its battery runs down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.sim.condition import Condition
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import SAMPLE_RATE_HZ

__all__ = ["EFFECT"]


def _drive(condition: Condition, values: Values) -> Condition:
    held = (np.arange(len(condition.command)) + 0.5) / SAMPLE_RATE_HZ  # middle of each command
    return replace(condition, command=condition.command * (1 + values["rate"] * held))


EFFECT = Effect(
    name="speed_drift",
    group="drive",
    sentence=(
        "the motor's speed {rate:rises|falls} during a run by {rate:size} of the commanded one"
    ),
    quantities=(Quantity("rate", "1/s", low=-0.05, high=0.05, tolerance=3e-4, step=1e-6),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_scale", "speed_offset", "motor_droop"),
    separated_by="a long run at one speed; the order of runs changed, or a pause to cool",
    drive=_drive,
)
