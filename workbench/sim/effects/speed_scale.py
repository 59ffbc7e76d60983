"""The motor turns faster than commanded by a share: the slope of its line is off."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.condition import Condition
from workbench.sim.effects.effect import Effect, Quantity, Values

__all__ = ["EFFECT"]


def _drive(condition: Condition, values: Values) -> Condition:
    return replace(condition, command=condition.command * (1 + values["share"]))


EFFECT = Effect(
    name="speed_scale",
    group="drive",
    sentence="the motor turns {share:faster|slower} than commanded by {share:size}",
    quantities=(Quantity("share", "1", low=-0.5, high=0.5, tolerance=0.005, step=1e-5),),
    excited_by=("clamped", "hop"),
    confused_with=("speed_offset", "motor_droop", "speed_drift", "time_offset"),
    separated_by="several speeds: a share grows with the speed, an offset does not",
    drive=_drive,
)
