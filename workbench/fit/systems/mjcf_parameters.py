"""What of a mechanism may be fitted: numbers of its MjSpec, of its drive and of what is seen.

`mjcf_fields` says how each is read from a spec and written to it; `parameter` makes a `Parameter`
of one together with the `Edit` that applies its value. Fields of the drive and of channels have
nothing to write: `mjcf` reads their values when it makes the controls and the observation.

Elements may share a number, `hip + knee`: it comes on top of what each of them has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.errors import InputError, did_you_mean
from workbench.fit.parameters import Acts, Parameter, Scope
from workbench.fit.systems.mjcf_fields import FIELDS, Owner

__all__ = [
    "SHARED",
    "Edit",
    "Free",
    "compiled",
    "elements_of",
    "explicit_inertias",
    "owner_of",
    "parameter",
    "total",
]

SHARED = " + "
"""Between the names of elements that share a number."""

_STEEP = 1e3  # a positive number stays within a thousandth and a thousand times its nominal value
_OUTSIDE = (Acts.DRIVE, Acts.OBSERVATION)  # what no spec has


@dataclass(frozen=True)
class Free:
    """A request to fit one number.

    Args:
        field: key of `FIELDS`.
        owner: name of the element, or those that share it; empty for gravity.
        deviation: of its prior [SI].
        scope: whether it belongs to the model or to a candidate that extends it.
        flat: whether its prior is left out of the likelihood.
        released: whether its prior is Cauchy's, not normal.
    """

    field: str
    owner: str
    deviation: float
    scope: Scope = Scope.MODEL
    flat: bool = False
    released: bool = False

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
        return elements_of(self.owner)

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


def elements_of(owner: str) -> tuple[str, ...]:
    """Return the names of the elements that share a number, or of the one that has it."""
    return tuple(owner.split(SHARED))


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
    if free.field == "frictionloss" and spec.option.disableflags & off:
        raise InputError(
            f"{free.owner} {free.field}: the model's options disable constraints or frictionloss, "
            "and MuJoCo's dry friction is a constraint; enable them in the MJCF file"
        )
    edit, nominal, least = free.edit, given, field.low
    if field.acts not in _OUTSIDE:
        stated = [field.read(spec, owner) for owner in edit.owners]
        nominal, least = (0.0, field.low - min(stated)) if edit.shared else (stated[0], field.low)
        least = nominal if field.adds else least
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
                      positive=positive, flat=free.flat, released=free.released)  # fmt: skip
    return found, edit
