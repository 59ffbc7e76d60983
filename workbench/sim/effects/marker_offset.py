"""The point taken for T sits off T on its body, so it turns with the beam's tip.

    seen = T + forward (cos t, -sin t) + up (sin t, cos t) in x, z,

t the turn of the tip from where it was at rest: foot pitch and all hinge angles. Forward and up are
those of the robot at rest. The rotor's angle is seen about that point as well, and its speed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.motion import (
    PITCH,
    ROTOR,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    TOP,
    position,
    rotor_angle,
    rotor_speed,
)
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.timeseries import TimeSeries

__all__ = ["EFFECT"]


def _observe(motion: TimeSeries, values: Values) -> TimeSeries:
    turn, (x, _, z) = _tip_turn(motion), TOP
    c, s = np.cos(turn), np.sin(turn)
    forward, up = values["forward"], values["up"]
    seen = motion.replaced(
        {x: motion[x] + forward * c + up * s, z: motion[z] - forward * s + up * c}
    )
    # what another effect did to the angle, such as a tilt, is in the places as well
    angle = rotor_angle(position(seen, TOP), position(seen, ROTOR))
    return seen.replaced({ROTOR_ANGLE: angle, ROTOR_SPEED: rotor_speed(motion.times, angle)})


def _tip_turn(motion: TimeSeries) -> NDArray[np.float64]:
    """Return how far the beam's tip has turned since the first sample, (n,) [rad]."""
    hinges = [motion[name] for name in motion.names if name.startswith("hinge_")]
    turn = motion[PITCH] + np.sum(hinges, axis=0)
    return turn - turn[0]


EFFECT = Effect(
    name="marker_offset",
    group="sensor",
    sentence=(
        "the point taken for T sits {forward:size} {forward:before|behind} T and {up:size} "
        "{up:above|below} it"
    ),
    quantities=tuple(
        Quantity(name, "m", low=-0.05, high=0.05, tolerance=0.002, step=1e-5)
        for name in ("forward", "up")
    ),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("foot_cg", "length_scale", "rest_shape_drift", "speed_ripple"),
    separated_by="the centre of the circle that the rotor makes about T; a caliper",
    observe=_observe,
)
