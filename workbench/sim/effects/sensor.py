"""Effects of the sensor: how the motion that the cameras report differs from the true one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.motion import (
    FOOT,
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

__all__ = ["EFFECTS"]


def _camera_tilt(motion: TimeSeries, values: Values) -> TimeSeries:
    tilt = values["tilt"]
    c, s = np.cos(tilt), np.sin(tilt)
    columns = {name: motion[name] + tilt for name in (PITCH, ROTOR_ANGLE)}
    for x, _, z in (FOOT, TOP, ROTOR):
        columns[x], columns[z] = c * motion[x] + s * motion[z], c * motion[z] - s * motion[x]
    return motion.replaced(columns)


CAMERA_TILT = Effect(
    name="camera_tilt",
    group="sensor",
    sentence="the cameras' vertical leans by {tilt} about the robot's sideways axis",
    quantities=(Quantity("tilt", "rad", low=-0.2, high=0.2, tolerance=0.003, step=1e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("ground_slope", "rest_shape_drift"),
    separated_by="a plumb line of two markers; the direction of gravity in flight",
    observe=_camera_tilt,
)
"""The cameras' vertical is tilted about +y: everything seen is turned about the foot at rest."""

TIME_OFFSET = Effect(
    name="time_offset",
    group="sensor",
    sentence="the cameras saw everything {late:size} {late:later|earlier} than their stamps say",
    quantities=(Quantity("late", "s", low=-0.5, high=0.5, tolerance=0.004, step=1e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("speed_offset", "speed_scale"),
    separated_by="several speeds: the rotor lags by the speed times the offset; a flash or knock "
    "that the cameras and the bench both record",
    observe=lambda motion, values: motion.shifted(-values["late"]),
)
"""The cameras' clock is off: everything is seen later than its stamp says.

The stamps move and no value does, so nothing is interpolated. It cannot be seen where time zero is
found in the motion itself, as for the twin of a run; it shows where stamps and command share a
clock.
"""


def _length_scale(motion: TimeSeries, values: Values) -> TimeSeries:
    names = (*FOOT, *TOP, *ROTOR)
    return motion.replaced({name: motion[name] * (1 + values["share"]) for name in names})


LENGTH_SCALE = Effect(
    name="length_scale",
    group="sensor",
    sentence=(
        "the cameras' scale is off: every position is too {share:large|small} by {share:size}"
    ),
    quantities=(Quantity("share", "1", low=-0.1, high=0.1, tolerance=0.002, step=1e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "rotor_unbalance", "top_mass", "marker_offset"),
    separated_by="a ruler: two fixed markers, or the rotor's own radius as the cameras see it",
    observe=_length_scale,
)
"""The cameras' calibration wand was off: all positions are too large by a share, angles right."""


def _marker_offset(motion: TimeSeries, values: Values) -> TimeSeries:
    turn, (x, _, z) = _tip_turn(motion), TOP
    c, s = np.cos(turn), np.sin(turn)
    forward, up = values["forward"], values["up"]
    seen = motion.replaced(
        {x: motion[x] + forward * c + up * s, z: motion[z] - forward * s + up * c}
    )
    # an effect on the angle, such as a tilt, is in the positions as well
    angle = rotor_angle(position(seen, TOP), position(seen, ROTOR))
    return seen.replaced({ROTOR_ANGLE: angle, ROTOR_SPEED: rotor_speed(motion.times, angle)})


def _tip_turn(motion: TimeSeries) -> NDArray[np.float64]:
    """Return how far the beam's tip has turned since the first sample, (n,) [rad]."""
    hinges = [motion[name] for name in motion.names if name.startswith("hinge_")]
    turn = motion[PITCH] + np.sum(hinges, axis=0)
    return turn - turn[0]


MARKER_OFFSET = Effect(
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
    observe=_marker_offset,
)
"""The point taken for T sits off T on its body, so it turns with the beam's tip.

    seen = T + forward (cos t, -sin t) + up (sin t, cos t) in x, z,

t the turn of the tip from where it was at rest: foot pitch and all hinge angles. Forward and up are
those of the robot at rest. The rotor's angle is seen about that point as well, and its speed.
"""

EFFECTS = (CAMERA_TILT, TIME_OFFSET, LENGTH_SCALE, MARKER_OFFSET)
