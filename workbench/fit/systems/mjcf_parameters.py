"""What of a mechanism may be fitted: fields of its MjSpec, of its drive and of what is seen.

A `Field` says how a number is read from a spec and written to it; `parameter` makes a `Parameter`
of it together with the `Edit` that applies its value. Fields of the drive and of channels have
nothing to write: `mjcf` reads their values when it makes the controls and the observation.

Elements may share a number, `hip + knee`: it comes on top of what each of them has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from workbench.errors import InputError, did_you_mean
from workbench.fit.parameters import Acts, Parameter, Scope

__all__ = [
    "FIELDS",
    "SHARED",
    "Edit",
    "Field",
    "Free",
    "compiled",
    "explicit_inertias",
    "owner_of",
    "parameter",
    "total",
]

SHARED = " + "
"""Between the names of elements that share a number."""

Owner = Literal["body", "joint", "actuator", "gravity", "input", "channel"]
Read = Callable[[mujoco.MjSpec, str], float]
Write = Callable[[mujoco.MjSpec, str, float], None]

_STEEP = 1e3  # a positive number stays within a thousandth and a thousand times its nominal value
_LEAST_SHARE = -0.99
_DEFAULT_SOLREF = (0.02, 1.0)
_DELAY_REACH = 5.0  # what is seen late is so to first order: what it moves in that time
_OUTSIDE = (Acts.DRIVE, Acts.OBSERVATION)  # what no spec has


@dataclass(frozen=True)
class Field:
    """A kind of number that may be fitted.

    Args:
        owner: kind of element that has it.
        unit: SI, with `F` for N m or N, `L` for rad or m, `I` for kg m^2 or kg, and `control`.
        read: its nominal value of a named element.
        write: sets it; None where it acts on the drive or on what is seen.
        acts: where it acts.
        low: least value allowed.
        reach: prior deviations around the nominal value within which it acts as it should.
    """

    owner: Owner
    unit: str
    read: Read
    write: Write | None = None
    acts: Acts = Acts.MODEL
    low: float = -np.inf
    reach: float = np.inf


@dataclass(frozen=True)
class Free:
    """A request to fit one number.

    Args:
        field: key of `FIELDS`.
        owner: name of the element, or those that share it; empty for gravity.
        deviation: of its prior [SI].
        scope: whether it belongs to the model or to a candidate that extends it.
        flat: whether its prior is left out of the likelihood.
    """

    field: str
    owner: str
    deviation: float
    scope: Scope = Scope.MODEL
    flat: bool = False

    @property
    def edit(self) -> Edit:
        """Return what it changes."""
        return Edit(self.field, self.owner)


@dataclass(frozen=True)
class Edit:
    """What a parameter changes: a field, by its key, of one element, or of some alike."""

    key: str
    owner: str

    @property
    def owners(self) -> tuple[str, ...]:
        """Return the names of the elements."""
        return tuple(self.owner.split(SHARED))

    @property
    def shared(self) -> bool:
        """Return whether it comes on top of what some elements have; such edits come last."""
        return len(self.owners) > 1

    def apply(self, spec: mujoco.MjSpec, value: float) -> None:
        """Write the value into a spec, if it belongs there; what is shared is added."""
        field = FIELDS[self.key]
        if field.write is None:
            return
        for owner in self.owners:
            field.write(spec, owner, value + (field.read(spec, owner) if self.shared else 0.0))


def total(given: Mapping[Edit, float], key: str, owner: str) -> float:
    """Return what edits make of a field that no spec has, of one element; zero where none does."""
    return sum(v for edit, v in given.items() if edit.key == key and owner in edit.owners)


def owner_of(free: Free) -> Owner:
    """Return the kind of element that a number belongs to.

    Raises:
        InputError: for an unknown field.
    """
    if free.field not in FIELDS:
        raise InputError(
            f"{free.field!r} cannot be fitted{did_you_mean(free.field, FIELDS)}; "
            f"there are {', '.join(FIELDS)}"
        )
    return FIELDS[free.field].owner


def _nothing(spec: mujoco.MjSpec, owner: str) -> float:
    return 0.0


def _whole(spec: mujoco.MjSpec, owner: str) -> float:
    return 1.0


def _read_mass(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.body(owner).mass)


def _write_mass(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    body = spec.body(owner)
    body.inertia = body.inertia * (value / body.mass)
    body.mass = value


def _write_inertia(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    body = spec.body(owner)
    body.inertia = body.inertia * value


def _read_distance(spec: mujoco.MjSpec, owner: str) -> float:
    return float(np.linalg.norm(spec.body(owner).pos))


def _write_distance(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    body = spec.body(owner)
    body.pos = body.pos * (value / float(np.linalg.norm(body.pos)))


def _read_friction(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.joint(owner).frictionloss)


def _read_armature(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.joint(owner).armature)


def _write_armature(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    spec.joint(owner).armature = value


def _angle(spec: mujoco.MjSpec, owner: str) -> float:
    """Return the SI value of the unit in which a spec keeps a joint's angles or places."""
    hinge = spec.joint(owner).type == mujoco.mjtJoint.mjJNT_HINGE
    return np.pi / 180 if hinge and spec.compiler.degree else 1.0


def _read_springref(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.joint(owner).springref) * _angle(spec, owner)


def _write_springref(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    spec.joint(owner).springref = value / _angle(spec, owner)


def _joint_term(name: str, power: int) -> tuple[Read, Write]:
    """Return access to a coefficient of MuJoCo's polynomials.

    A spring resists with k x + k2 x^2 + k3 x^3, a damper with d v + d2 v |v| + d3 v^3.
    """

    def read(spec: mujoco.MjSpec, owner: str) -> float:
        return float(getattr(spec.joint(owner), name)[power - 1])

    def write(spec: mujoco.MjSpec, owner: str, value: float) -> None:
        getattr(spec.joint(owner), name)[power - 1] = value

    return read, write


def _write_friction(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    """Set dry friction; where the model had none, as sharp as its step allows.

    With MuJoCo's default of 20 ms a slow joint creeps as if in oil. Settings that the file states
    stay, and so do those of a joint that has friction already.
    """
    joint = spec.joint(owner)
    if joint.frictionloss == 0 and tuple(joint.solref_friction) == _DEFAULT_SOLREF:
        joint.solref_friction = [2 * spec.option.timestep, 1.0]
    joint.frictionloss = value


def _read_gain(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.actuator(owner).gainprm[0])


def _write_gain(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    """Set an actuator's gain, and the feedback of a position servo, which is its opposite."""
    actuator = spec.actuator(owner)
    servo = actuator.biastype == mujoco.mjtBias.mjBIAS_AFFINE
    if servo and actuator.biasprm[1] == -actuator.gainprm[0]:
        actuator.biasprm[1] = -value
    actuator.gainprm[0] = value


def _read_bias(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.actuator(owner).biasprm[0])


def _write_bias(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    actuator = spec.actuator(owner)
    if actuator.biastype == mujoco.mjtBias.mjBIAS_NONE:
        actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.biasprm[0] = value


def _read_gear(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.actuator(owner).gear[0])


def _write_gear(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    spec.actuator(owner).gear[0] = value


def _tilt(axis: int) -> Write:
    def write(spec: mujoco.MjSpec, owner: str, value: float) -> None:
        one, other = (axis + 1) % 3, (axis + 2) % 3
        gravity = spec.option.gravity.copy()
        cos, sin = np.cos(value), np.sin(value)
        turned = gravity.copy()
        turned[one] = cos * gravity[one] - sin * gravity[other]
        turned[other] = sin * gravity[one] + cos * gravity[other]
        spec.option.gravity = turned

    return write


def _drive(unit: str, low: float = -np.inf) -> Field:
    return Field("input", unit, _nothing, None, Acts.DRIVE, low)


def _sensor(unit: str, low: float = -np.inf) -> Field:
    return Field("channel", unit, _nothing, None, Acts.OBSERVATION, low)


FIELDS: dict[str, Field] = {
    "mass": Field("body", "kg", _read_mass, _write_mass, low=0.0),
    "inertia": Field("body", "1", _whole, _write_inertia, low=0.0),
    "distance": Field("body", "m", _read_distance, _write_distance, low=0.0),
    "stiffness": Field("joint", "F/L", *_joint_term("stiffness", 1), low=0.0),
    "even_stiffness": Field("joint", "F/L^2", *_joint_term("stiffness", 2)),
    "cubic_stiffness": Field("joint", "F/L^3", *_joint_term("stiffness", 3)),
    "springref": Field("joint", "L", _read_springref, _write_springref),
    "damping": Field("joint", "F s/L", *_joint_term("damping", 1), low=0.0),
    "quadratic_damping": Field("joint", "F s^2/L^2", *_joint_term("damping", 2), low=0.0),
    "cubic_damping": Field("joint", "F s^3/L^3", *_joint_term("damping", 3), low=0.0),
    "frictionloss": Field("joint", "F", _read_friction, _write_friction, low=0.0),
    "armature": Field("joint", "I", _read_armature, _write_armature, low=0.0),
    "gain": Field("actuator", "F/control", _read_gain, _write_gain),
    "bias": Field("actuator", "F", _read_bias, _write_bias),
    "gear": Field("actuator", "1", _read_gear, _write_gear),
    "tilt_x": Field("gravity", "rad", _nothing, _tilt(0)),
    "tilt_y": Field("gravity", "rad", _nothing, _tilt(1)),
    "input_scale": _drive("1", _LEAST_SHARE),
    "input_offset": _drive("control"),
    "input_delay": _drive("s"),
    "input_lag": _drive("s", 0.0),
    "scale": _sensor("1", _LEAST_SHARE),
    "offset": _sensor("L"),
    "delay": Field("channel", "s", _nothing, None, Acts.OBSERVATION, reach=_DELAY_REACH),
}
"""What may be fitted. A mass carries its inertia with it; `inertia` is a factor on top of that.
Scales are shares beyond 1. An input's delay and lag act on the control, before the actuator."""


def explicit_inertias(spec: mujoco.MjSpec) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Return a copy of a spec whose bodies state their masses and inertias, and its model.

    What the compiler made of geoms and of its own options becomes a number that an edit can change.

    Raises:
        InputError: when MuJoCo refuses it.
    """
    spec = spec.copy()
    spec.compiler.fusestatic = False
    try:
        model = spec.compile()
        for body in spec.bodies[1:]:
            row = body.id
            body.mass, body.ipos = float(model.body_mass[row]), model.body_ipos[row]
            body.iquat, body.inertia = model.body_iquat[row], model.body_inertia[row]
            body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
            body.fullinertia = np.full(6, np.nan)
            body.explicitinertial = True
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        spec.compiler.settotalmass = -1.0
        return spec, spec.compile()
    except ValueError as error:
        raise InputError(f"{spec.modelname}: MuJoCo refuses it: {error}") from None


def compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return the model of a spec.

    Raises:
        InputError: when MuJoCo refuses it.
    """
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(f"{spec.modelname}: MuJoCo refuses it: {error}") from None


def parameter(
    spec: mujoco.MjSpec, free: Free, units: Mapping[str, str], given: float = 0.0
) -> tuple[Parameter, Edit]:
    """Return a parameter at its nominal value, and what it edits.

    Args:
        spec: with explicit inertias.
        free: what is asked; its field and owner exist.
        units: of `F`, `L`, `I` and `control`.
        given: nominal value of a number of an input or a channel, which no spec has.

    Raises:
        InputError: for a friction that the model's options switch off.
    """
    field = FIELDS[free.field]
    off = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    if field.write is _write_friction and spec.option.disableflags & off:
        raise InputError(
            f"{free.owner} {free.field}: the model's options disable constraints or frictionloss, "
            "and MuJoCo's dry friction is a constraint; enable them in the MJCF file"
        )
    edit, nominal, least = free.edit, given, field.low
    if field.acts not in _OUTSIDE:
        stated = [field.read(spec, owner) for owner in edit.owners]
        nominal, least = (0.0, field.low - min(stated)) if edit.shared else (stated[0], field.low)
    wide = field.owner != "body" and free.deviation >= nominal  # zero is near, logarithms far
    positive = nominal > 0 and least == 0 and not wide
    reach = field.reach * free.deviation
    low, high = max(least, nominal - reach), nominal + reach
    if positive:
        low, high = nominal / _STEEP, nominal * _STEEP
    unit = field.unit
    for symbol, words in units.items():
        unit = unit.replace(symbol, words)
    name = f"{free.owner} {free.field}".strip()
    found = Parameter(name, unit, nominal, free.deviation, low, high, free.scope, field.acts,
                      positive=positive, flat=free.flat)  # fmt: skip
    return found, edit
