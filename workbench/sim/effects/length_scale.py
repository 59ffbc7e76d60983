"""The cameras' wand was mistaken: all places are too large by a share; angles are right."""

from __future__ import annotations

from workbench.motion import FOOT, ROTOR, TOP
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.timeseries import TimeSeries

__all__ = ["EFFECT"]


def _observe(motion: TimeSeries, values: Values) -> TimeSeries:
    names = (*FOOT, *TOP, *ROTOR)
    return motion.replaced({name: motion[name] * (1 + values["share"]) for name in names})


EFFECT = Effect(
    name="length_scale",
    group="sensor",
    sentence=(
        "the cameras' metre is off: every place and way is too {share:large|small} by {share:size}"
    ),
    quantities=(Quantity("share", "1", low=-0.1, high=0.1, tolerance=0.002, step=1e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "rotor_unbalance", "top_mass", "marker_offset"),
    separated_by="a ruler: two fixed markers, or the rotor's own radius as the cameras see it",
    observe=_observe,
)
