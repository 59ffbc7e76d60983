"""Effects of dissipation: damping, dry friction and air drag of the beam."""

from __future__ import annotations

import mujoco

from workbench.sim.beam_laws import add_law
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.scaling import scaled, turn_ratio
from workbench.sim.robot import Robot, hinge_name

__all__ = ["EFFECTS"]

HINGE_DAMPING = Effect(
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
    alter=lambda robot, values: scaled(robot, values["share"], "hinge_damping"),
)

_SOLIMP = [0.9999, 0.9999, 0.001, 0.5, 2]
"""Impedance, the engine's greatest: a hinge at rest creeps by 1e-4 of what it would without."""
_SOLREF = [0.002, 1]
"""Time constant [s] and damping ratio with which a hinge comes to rest. At ten times this a tenth
of the energy is not dissipated, at a quarter of it a robot at rest vibrates by micrometres."""


def _hinge_coulomb_friction(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)  # contacts stay off
    for k, hinge in enumerate(robot.hinges[1:], start=1):
        if hinge.stiffness is not None:
            joint = spec.joint(hinge_name(k))
            joint.frictionloss = values["torque"]
            joint.solimp_friction, joint.solref_friction = _SOLIMP, _SOLREF


HINGE_COULOMB_FRICTION = Effect(
    name="hinge_coulomb_friction",
    group="dissipation",
    sentence="dry friction of {torque} in every hinge of the beam",
    quantities=(Quantity("torque", "N m", low=0.0, high=0.1, tolerance=0.0001, step=1e-05),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_quadratic_damping", "hinge_damping", "root_play"),
    separated_by="a ring-down to the end: it fades along a straight line; a slow pull and return",
    build=_hinge_coulomb_friction,
)
"""Dry friction in every hinge but the foot joint: a torque that does not depend on speed.

MuJoCo's own friction loss. The moment is the same in a finer chain, so is the breakaway torque.
"""


def _hinge_quadratic_damping(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    for k, hinge in enumerate(robot.hinges[1:], start=1):
        if hinge.stiffness is not None:
            spec.joint(hinge_name(k)).damping[1] += values["c"] / turn_ratio(robot, hinge) ** 2


HINGE_QUADRATIC_DAMPING = Effect(
    name="hinge_quadratic_damping",
    group="dissipation",
    sentence="the beam damps more the faster it bends, with a quadratic term of {c} in every hinge",
    quantities=(Quantity("c", "N m s^2/rad^2", low=0.0, high=1.0, tolerance=0.003, step=5e-5),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_coulomb_friction", "hinge_damping", "air_drag", "hinge_cubic_stiffness"),
    separated_by="ring-downs at three amplitudes: the decay rate grows with the amplitude",
    build=_hinge_quadratic_damping,
)
"""The strip's damping grows with its speed: a quadratic term on every hinge but the foot joint.

torque = -d w - c w |w|, w the hinge's speed; MuJoCo's own damping polynomial.
"""

AIR_DRAG = Effect(
    name="air_drag",
    group="dissipation",
    sentence="air brakes the top with a drag of {c} times its speed squared",
    quantities=(Quantity("c", "N s^2/m^2", low=0.0, high=2.0, tolerance=0.002, step=0.0002),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_quadratic_damping", "hinge_damping"),
    separated_by="a plate of known area on T: the drag grows by its share; other modes of the beam",
    build=lambda spec, _, values: add_law(spec, {"top_drag": values["c"]}),
)
"""Air brakes T: a force -c |v| v against its motion through the room."""

EFFECTS = (HINGE_DAMPING, HINGE_COULOMB_FRICTION, HINGE_QUADRATIC_DAMPING, AIR_DRAG)
