"""The rotor turns unevenly within a turn: a bent shaft, eccentric gears, a weight on one side.

speed = command (1 + cos_1 cos p + sin_1 sin p + cos_2 cos 2p + sin_2 sin 2p), p the rotor's angle
in the world about +y from +x. The second order is that of an oval gear or of two shafts askew.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.robot import Robot
from workbench.sim.uneven import let_ripple

__all__ = ["EFFECT"]

_SHARES = ("cos_1", "sin_1", "cos_2", "sin_2")


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    let_ripple(spec, [values[name] for name in _SHARES])


EFFECT = Effect(
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
    build=_build,
)
