"""Effects from outside: forces on the robot beside floor and gravity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.sim.beam_laws import Law, add_law
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.equilibrium import settle, unloaded
from workbench.sim.robot import Robot

__all__ = ["EFFECTS"]

_HANGING = np.pi / 2  # the rotor straight below T


def _tether(robot: Robot, values: Values) -> Robot:
    _, data = settle(unloaded(robot), "fixed", _HANGING)
    pull: dict[Law, float] = {
        "top_pull": values["pull"],
        "top_stiffness": values["stiffness"],
        "top_x": float(data.body("top").xpos[0]),
    }
    return replace(robot, edits=(*robot.edits, lambda spec, _: add_law(spec, pull)))


TETHER = Effect(
    name="tether",
    group="outside",
    sentence=(
        "a cable pulls the top {pull:forward|backward} by {pull:size}, and back to its rest "
        "position by {stiffness}"
    ),
    quantities=(
        Quantity("stiffness", "N/m", low=0.0, high=50.0, tolerance=0.05, step=0.005),
        Quantity("pull", "N", low=-1.0, high=1.0, tolerance=0.005, step=0.0005),
    ),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("rest_shape_drift", "ground_slope"),
    separated_by="a run with the cable slack or on a battery; runs far from the anchor and near it",
    alter=_tether,
)
"""A cable pulls on T: by a constant force and a spring about T's position at rest.

force = pull - k (x - x0) forward. The cable hangs from far above, so it acts along the floor only;
x0 is where T rests, the rotor hanging, with the foot clamped. Its weight is `top_mass`.
"""

EFFECTS = (TETHER,)
