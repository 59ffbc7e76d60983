"""The motor turns faster than commanded by a constant: the line's intercept is off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.sim.condition import Condition
from workbench.sim.effects.effect import Effect, Quantity, Values

__all__ = ["EFFECT"]


def _drive(condition: Condition, values: Values) -> Condition:
    faster = values["offset"] * np.sign(condition.command)  # a motor that is off stays off
    return replace(condition, command=condition.command + faster)


EFFECT = Effect(
    name="speed_offset",
    group="drive",
    sentence=(
        "the motor turns {offset:faster|slower} than commanded by {offset:size} at every speed"
    ),
    quantities=(Quantity("offset", "rad/s", low=-10, high=10, tolerance=0.1, step=1e-4),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_scale", "motor_droop", "speed_drift", "time_offset"),
    separated_by="several speeds: a share grows with the speed, an offset does not",
    drive=_drive,
)
