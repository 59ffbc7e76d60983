"""Air brakes T: a force -c |v| v against its motion through the room."""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.laws import add_law
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    add_law(spec, {"top_drag": values["c"]})


EFFECT = Effect(
    name="air_drag",
    group="dissipation",
    sentence="air brakes the top with a drag of {c} times its speed squared",
    quantities=(Quantity("c", "N s^2/m^2", low=0.0, high=2.0, tolerance=0.002, step=0.0002),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_quadratic_damping", "hinge_damping"),
    separated_by="a card of known area on T: the drag grows by its share; other modes of the beam",
    build=_build,
)
