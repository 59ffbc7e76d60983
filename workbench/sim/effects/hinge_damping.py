"""The strip damps more or less than the model says, all hinges alike."""

from __future__ import annotations

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.shares import scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECT"]


def _alter(robot: Robot, values: Values) -> Robot:
    return scaled(robot, values["share"], "hinge_damping")


EFFECT = Effect(
    name="hinge_damping",
    group="dissipation",
    sentence="the beam's hinges damp {share:more|less} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-1.0, high=20.0, tolerance=0.3, step=0.03),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=(
        "hinge_quadratic_damping",
        "hinge_coulomb_friction",
        "air_drag",
        "rotor_unbalance",
        "time_step",
    ),
    separated_by="ring-downs at three amplitudes: the decay rate is the same in all",
    alter=_alter,
)
