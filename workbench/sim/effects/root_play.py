"""The foot joint has play: it turns freely within a gap before its spring acts.

torque = -k dead(a), zero within the gap either way and k times what is beyond it. In the gap the
robot topples to one side, so it may stand on either end of it. The joint's damping stays.
"""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.laws import add_law
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _build(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    add_law(spec, {"root_gap": values["gap"]})


EFFECT = Effect(
    name="root_play",
    group="structure",
    sentence="the joint of beam and foot has play: it turns freely by {gap} either way",
    quantities=(Quantity("gap", "rad", low=0.0, high=0.1, tolerance=0.001, step=0.0001),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_cubic_stiffness", "hinge_coulomb_friction", "rest_shape_drift"),
    separated_by="ring-downs of small amplitude: the frequency falls; a slow pull both ways",
    build=_build,
)
