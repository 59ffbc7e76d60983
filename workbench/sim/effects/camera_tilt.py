"""The cameras' vertical is tilted about +y: everything seen is turned about the foot at rest."""

from __future__ import annotations

import numpy as np

from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.timeseries import TimeSeries

__all__ = ["EFFECT"]


def _observe(motion: TimeSeries, values: Values) -> TimeSeries:
    tilt = values["tilt"]
    c, s = np.cos(tilt), np.sin(tilt)
    columns = {name: motion[name] + tilt for name in (PITCH, ROTOR_ANGLE)}
    for x, _, z in (FOOT, TOP, ROTOR):
        columns[x], columns[z] = c * motion[x] + s * motion[z], c * motion[z] - s * motion[x]
    return motion.replaced(columns)


EFFECT = Effect(
    name="camera_tilt",
    group="sensor",
    sentence="the cameras' vertical leans by {tilt} about the robot's sideways axis",
    quantities=(Quantity("tilt", "rad", low=-0.2, high=0.2, tolerance=0.003, step=1e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("ground_slope", "rest_shape_drift"),
    separated_by="a plumb line of two markers; the direction of gravity in flight",
    observe=_observe,
)
