"""Effects from outside: forces on the robot beside floor and gravity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import mujoco
import numpy as np

from workbench.sim.beam_laws import Law, add_law
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.equilibrium import settle, unloaded
from workbench.sim.robot import Robot

__all__ = ["EFFECTS"]

_HANGING = np.pi / 2  # the rotor straight below T
_KEPT = 128  # robots: those of a Jacobian are asked for run by run


@dataclass(frozen=True)
class _Cable:
    """A cable's change of the MjSpec; equal to another of the same numbers."""

    pull: float
    stiffness: float
    x: float

    def __call__(self, spec: mujoco.MjSpec, _: Robot) -> None:
        names: tuple[Law, ...] = ("top_pull", "top_stiffness", "top_x")
        add_law(spec, dict(zip(names, (self.pull, self.stiffness, self.x), strict=True)))


def _tether(robot: Robot, values: Values) -> Robot:
    cable = _Cable(values["pull"], values["stiffness"], _forward(robot))
    return replace(robot, edits=(*robot.edits, cable))


@lru_cache(_KEPT)
def _forward(robot: Robot) -> float:
    """Return where T rests forward, the rotor hanging and the foot clamped [m]."""
    _, data = settle(unloaded(robot), "fixed", _HANGING)
    return float(data.body("top").xpos[0])


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
