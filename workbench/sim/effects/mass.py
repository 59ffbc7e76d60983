"""Effects of mass: masses and their positions."""

from __future__ import annotations

import mujoco

from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.scaling import added, scaled
from workbench.sim.robot import Robot

__all__ = ["EFFECTS"]

TOP_MASS = Effect(
    name="top_mass",
    group="mass",
    sentence="the top is {mass:heavier|lighter} than the model says by {mass:size}",
    quantities=(Quantity("mass", "kg", low=-0.08, high=0.5, tolerance=0.002, step=5e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "length_scale"),
    separated_by="weighing; a known mass added on T",
    alter=lambda robot, values: added(robot, values["mass"], "top_mass"),
)

FOOT_MASS = Effect(
    name="foot_mass",
    group="mass",
    sentence="the foot is {mass:heavier|lighter} than the model says by {mass:size}",
    quantities=(Quantity("mass", "kg", low=-0.07, high=0.5, tolerance=0.002, step=0.0002),),
    excited_by=("hop", "drop"),
    confused_with=("foot_cg", "ground_stiffness", "ground_damping"),
    separated_by="weighing",
    alter=lambda robot, values: added(robot, values["mass"], "foot_mass"),
)


def _foot_cg(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    spec.body("foot").ipos[0] += values["forward"]


FOOT_CG = Effect(
    name="foot_cg",
    group="mass",
    sentence=(
        "the foot's centre of gravity lies {forward:forward|backward} of its centre by "
        "{forward:size}"
    ),
    quantities=(Quantity("forward", "m", low=-0.13, high=0.13, tolerance=0.003, step=0.0003),),
    excited_by=("hop", "drop"),
    confused_with=("foot_mass", "ground_slope", "marker_offset"),
    separated_by="balancing the foot on an edge",
    build=_foot_cg,
)
"""The foot's centre of gravity is not at its centre; shows only when the foot moves."""


def _rotor_unbalance(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    spec.site("rotor").pos[0] = robot.values["rotor_radius"] / (1 + values["share"])


ROTOR_UNBALANCE = Effect(
    name="rotor_unbalance",
    group="mass",
    sentence=(
        "the rotor's unbalance, mass times radius, is {share:greater|smaller} than the model "
        "says by {share:size}"
    ),
    quantities=(Quantity("share", "1", low=-0.9, high=2.0, tolerance=0.02, step=0.002),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_damping", "speed_ripple", "length_scale"),
    separated_by="weighing the rotor and balancing it on an edge; speeds well away from resonance",
    alter=lambda robot, values: scaled(robot, values["share"], "rotor_radius"),
    build=_rotor_unbalance,
)
"""The rotor's unbalance M_R L_R is greater than the model says: its mass sits farther out.

The site that cameras see does not move.
"""

EFFECTS = (TOP_MASS, FOOT_MASS, FOOT_CG, ROTOR_UNBALANCE)
