"""The numbers of an MJCF model that may be other than stated, and the generic causes on them."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.diagnose.rig import Cause, Unknown
from workbench.protocol import ChannelEffect, InputEffect, JointEffect, RigField

__all__ = [
    "CHANNEL_EFFECTS",
    "FURTHEST",
    "INPUT_EFFECTS",
    "JOINT_EFFECTS",
    "MASS",
    "Generic",
    "cause_of",
    "field_unit",
    "joint_unit",
    "read_field",
    "set_field",
]

Add = Callable[[mujoco.MjModel, int, float], None]
"""Adds to a number of the joint or body of an index, in place."""

FURTHEST = 1e3
"""How many tolerances away a number is sought that nothing else bounds."""
_MOST_SHARE = 0.99  # of a stated number that may be missing
_STEP = 1e-3  # of a tolerance
_BODY_UNITS: dict[str, str] = {"mass": "kg", "distance": "m"}
_PATTERNS = {"stiffness": "F/L", "damping": "F s/L", "frictionloss": "F", "springref": "L"}


@dataclass(frozen=True)
class Generic:
    """A cause that any joint, body, channel or input may have.

    Args:
        group: kind of cause.
        quantity: name of its one number.
        unit: for a slide, with `F` for force and `L` for place; a hinge has N m and rad.
        sentence: with `{owner}` and the quantity.
        separated_by: what tells it from what it is confused with.
        confused_with: effects of the same owner that look alike.
        positive: whether it is physically impossible below zero.
        releases: field of the same owner that it is added to.
        add: what it does to a model; None where it acts on inputs or channels.
    """

    group: str
    quantity: str
    unit: str
    sentence: str
    separated_by: str
    confused_with: tuple[str, ...] = ()
    positive: bool = False
    releases: RigField | None = None
    add: Add | None = None


def _dof(model: mujoco.MjModel, joint: int) -> int:
    return int(model.jnt_dofadr[joint])


def _add_stiffness(order: int) -> Add:
    def add(model: mujoco.MjModel, joint: int, value: float) -> None:
        if order == 1:
            model.jnt_stiffness[joint] += value
        else:
            model.jnt_stiffnesspoly[joint, order - 2] += value

    return add


def _add_damping(order: int) -> Add:
    def add(model: mujoco.MjModel, joint: int, value: float) -> None:
        if order == 1:
            model.dof_damping[_dof(model, joint)] += value
        else:
            model.dof_dampingpoly[_dof(model, joint), order - 2] += value

    return add


def _add_friction(model: mujoco.MjModel, joint: int, value: float) -> None:
    dof = _dof(model, joint)
    if model.dof_frictionloss[dof] == 0:
        # as sharp as the step allows; MuJoCo's own 20 ms let a slow joint creep as if in oil
        model.dof_solref[dof] = [2 * model.opt.timestep, 1]
    model.dof_frictionloss[dof] += value


def _add_rest(model: mujoco.MjModel, joint: int, value: float) -> None:
    model.qpos_spring[model.jnt_qposadr[joint]] += value


def _add_mass(model: mujoco.MjModel, body: int, value: float) -> None:
    set_field(model, "mass", body, float(model.body_mass[body]) + value)


_AMPLITUDES = "releases from three heights: what depends on amplitude changes along a ring-down"

JOINT_EFFECTS: dict[JointEffect, Generic] = {
    "stiffness": Generic(
        "structure", "k", "F/L",
        "the spring of {owner} is {{k:stiffer|softer}} than stated by {{k:size}}",
        "weighing, and the frequency of small swings", ("even_stiffness", "cubic_stiffness"),
        releases="stiffness", add=_add_stiffness(1),
    ),
    "even_stiffness": Generic(
        "structure", "k2", "F/L^2", "{owner} is stiffer to one side, with a square term of {{k2}}",
        "the mean place while it swings moves with the amplitude", ("rest_shift",),
        add=_add_stiffness(2),
    ),
    "cubic_stiffness": Generic(
        "structure", "k3", "F/L^3",
        "{owner} {{k3:stiffens|softens}} as it moves, with a cubic term of {{k3}}",
        _AMPLITUDES, ("stiffness", "quadratic_damping"), add=_add_stiffness(3),
    ),
    "rest_shift": Generic(
        "structure", "shift", "L", "the spring of {owner} rests {{shift}} from where it should",
        "pictures at rest with and without load", ("even_stiffness",), add=_add_rest,
    ),
    "damping": Generic(
        "dissipation", "d", "F s/L", "{owner} is damped {{d:more|less}} than stated by {{d:size}}",
        _AMPLITUDES, ("coulomb_friction", "quadratic_damping"),
        releases="damping", add=_add_damping(1),
    ),
    "quadratic_damping": Generic(
        "dissipation", "d2", "F s^2/L^2",
        "{owner} is damped with the square of its speed, by {{d2}}",
        _AMPLITUDES, ("damping", "cubic_damping", "coulomb_friction"), positive=True,
        add=_add_damping(2),
    ),
    "cubic_damping": Generic(
        "dissipation", "d3", "F s^3/L^3",
        "{owner} is damped with the cube of its speed, by {{d3}}",
        _AMPLITUDES, ("quadratic_damping",), positive=True, add=_add_damping(3),
    ),
    "coulomb_friction": Generic(
        "dissipation", "friction", "F", "{owner} rubs dry with {{friction}}",
        "a ring-down to its very end: dry friction stops it, a damper never does",
        ("damping", "quadratic_damping"), releases="frictionloss", add=_add_friction,
    ),
}  # fmt: skip

MASS = Generic(
    "mass", "mass", "kg", "{owner} is {{mass:heavier|lighter}} than stated by {{mass:size}}",
    "weighing it", releases="mass", add=_add_mass,
)  # fmt: skip

CHANNEL_EFFECTS: dict[ChannelEffect, Generic] = {
    "offset": Generic(
        "sensor", "offset", "L", "channel {owner} reads {{offset:size}} too {{offset:much|little}}",
        "the reading at a known place", ("gain",),
    ),
    "gain": Generic(
        "sensor", "share", "1", "channel {owner} reads too {{share:much|little}} by {{share:size}}",
        "a ruler or a protractor", ("offset",),
    ),
    "delay": Generic(
        "sensor", "delay", "s",
        "channel {owner} shows everything {{delay:size}} {{delay:late|early}}",
        "several frequencies: its phase lag grows with the frequency",
    ),
}  # fmt: skip

INPUT_EFFECTS: dict[InputEffect, Generic] = {
    "offset": Generic(
        "drive", "offset", "control",
        "input {owner} acts with {{offset:size}} {{offset:more|less}} than recorded",
        "the place at rest without input",
    ),
    "gain": Generic(
        "drive", "share", "1",
        "input {owner} acts {{share:more strongly|more weakly}} than recorded by {{share:size}}",
        "a load cell", ("delay",),
    ),
    "delay": Generic(
        "drive", "delay", "s",
        "input {owner} acts {{delay:size}} {{delay:later|earlier}} than recorded",
        "a step of the input, seen by all channels", ("gain",),
    ),
}  # fmt: skip


def cause_of(
    generic: Generic,
    owner: str,
    effect: str,
    tolerance: float,
    unit: str,
    stated: float | None = None,
    present: Collection[str] = (),
    replaces: tuple[str, ...] = (),
) -> Cause:
    """Return a generic cause on an owner.

    Args:
        generic: what kind.
        owner: joint, body, channel or input.
        effect: its name in the rig file.
        tolerance: how large it may well be [unit].
        unit: SI.
        stated: the model's number that it is added to; what is left must stay above zero.
        present: effects that the owner may have as well.
        replaces: base numbers whose release it is.
    """
    name = f"{owner}_{effect}"
    low = -FURTHEST * tolerance
    if stated is not None:
        low = -_MOST_SHARE * stated
    elif generic.positive:
        low = 0.0
    elif unit == "1":
        low = -_MOST_SHARE
    high = FURTHEST * tolerance
    return Cause(
        name=name,
        group=generic.group,
        sentence=generic.sentence.format(owner=owner),
        unknowns=(
            Unknown(
                f"{name}.{generic.quantity}", unit, 0.0, tolerance, low, high, _STEP * tolerance
            ),
        ),
        confused_with=tuple(
            f"{owner}_{other}" for other in generic.confused_with if other in present
        ),
        separated_by=generic.separated_by,
        replaces=replaces,
    )


def joint_unit(pattern: str, model: mujoco.MjModel, joint: int) -> str:
    """Return a unit for a joint of this type, from one with `F` for force and `L` for place."""
    hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
    return pattern.replace("F", "N m" if hinge else "N").replace("L", "rad" if hinge else "m")


def field_unit(model: mujoco.MjModel, field: RigField, owner: int) -> str:
    """Return the SI unit of a number of the joint or body of an index."""
    if field in _BODY_UNITS:
        return _BODY_UNITS[field]
    hinge = model.jnt_type[owner] == mujoco.mjtJoint.mjJNT_HINGE
    if field == "armature":
        return "kg m^2" if hinge else "kg"
    return joint_unit(_PATTERNS[field], model, owner)


def read_field(model: mujoco.MjModel, field: RigField, owner: int) -> float:
    """Return a number of the joint or body of an index."""
    if field == "mass":
        return float(model.body_mass[owner])
    if field == "distance":
        return float(np.linalg.norm(model.body_pos[owner]))
    if field == "stiffness":
        return float(model.jnt_stiffness[owner])
    if field == "springref":
        return float(model.qpos_spring[model.jnt_qposadr[owner]])
    return float(getattr(model, f"dof_{field}")[_dof(model, owner)])


def set_field(model: mujoco.MjModel, field: RigField, owner: int, value: float) -> None:
    """Set a number of the joint or body of an index; `mujoco.mj_setConst` must follow."""
    if field == "mass":
        model.body_inertia[owner] *= value / model.body_mass[owner]
        model.body_mass[owner] = value
    elif field == "distance":
        model.body_pos[owner] *= value / np.linalg.norm(model.body_pos[owner])
    elif field == "stiffness":
        model.jnt_stiffness[owner] = value
    elif field == "springref":
        model.qpos_spring[model.jnt_qposadr[owner]] = value
    else:
        getattr(model, f"dof_{field}")[_dof(model, owner)] = value
