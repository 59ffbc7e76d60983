"""The cameras' clock is off: everything is seen later than its stamp says.

The stamps move and no value does, so nothing is interpolated. A reader that takes the motion at
given times sees it shifted; one that finds time zero in the motion itself, as the twin of a run
does on both sides, cannot see it. It is left where stamps and command share one clock.
"""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.timeseries import TimeSeries

__all__ = ["EFFECT"]


def _observe(motion: TimeSeries, values: Values) -> TimeSeries:
    return motion.shifted(-values["late"])


EFFECT = Effect(
    name="time_offset",
    group="sensor",
    sentence="the cameras saw everything {late:size} {late:later|earlier} than their stamps say",
    quantities=(Quantity("late", "s", low=-0.5, high=0.5, tolerance=0.004, step=1e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("speed_offset", "speed_scale"),
    separated_by="several speeds: the rotor lags by the speed times the offset; a flash or knock "
    "that the cameras and the bench both record",
    observe=_observe,
)
