"""`workbench/model-1`: the robot's parameters, each with unit, value, tolerance and source."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from workbench.schemas.section import Section

__all__ = ["UNITS", "EffectEntry", "ModelFile", "ModelParameter", "Parameters", "value_fault"]

UNITS: dict[str, str] = {
    "foot_mass": "kg",
    "foot_length": "m",
    "foot_width": "m",
    "beam_root": "m",
    "beam_mass": "kg",
    "hinge_stiffness": "N m/rad",
    "hinge_damping": "N m s/rad",
    "root_stiffness": "N m/rad",
    "root_damping": "N m s/rad",
    "top_mass": "kg",
    "rotor_mass": "kg",
    "rotor_arm_mass": "kg",
    "rotor_radius": "m",
    "friction_slide": "1",
    "friction_stick": "1",
    "friction_threshold": "m/s",
    "ground_stiffness": "N/m",
    "ground_damping": "N s/m",
    "ground_stiffness_y": "N/m",
    "ground_damping_y": "N s/m",
    "gravity": "m/s^2",
}
"""Parameter -> the unit that a model file must state for it."""

_MAY_BE_NEGATIVE = {"beam_root"}
_MAY_BE_ZERO = {
    "hinge_damping", "root_damping", "friction_slide", "friction_stick", "ground_damping",
    "ground_stiffness_y", "ground_damping_y", "gravity", "rotor_arm_mass",
}  # fmt: skip


def value_fault(name: str, value: float) -> str | None:
    """Return what a parameter must be, such as "above 0", or None where the value is that."""
    if name in _MAY_BE_NEGATIVE:
        return None if math.isfinite(value) else "a number"
    if math.isfinite(value) and (value > 0 or (value == 0 and name in _MAY_BE_ZERO)):
        return None
    return "at least 0" if name in _MAY_BE_ZERO else "above 0"


class ModelParameter(Section):
    """One number of the robot."""

    value: Annotated[float, Field(allow_inf_nan=False)]
    unit: str
    tolerance: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    """How far the true value may lie from the stated one, in the same unit."""
    source: str
    """Where the value comes from."""


class Parameters(Section):
    """Every parameter of the thesis' Appendix B, under its name here."""

    foot_mass: ModelParameter
    """M_B, foot without beam."""
    foot_length: ModelParameter
    """L_B, stance in the hopping direction."""
    foot_width: ModelParameter
    """B_B, stance across."""
    beam_root: ModelParameter
    """L_Orig, where the beam starts, forward of the foot's centre."""
    beam_mass: ModelParameter
    """Mass of the whole beam, shared equally by its increments."""
    hinge_stiffness: ModelParameter
    """k_Leg, between two increments of a beam of 16."""
    hinge_damping: ModelParameter
    """d_Leg, between two increments of a beam of 16."""
    root_stiffness: ModelParameter
    """k_T, between the foot and the first increment."""
    root_damping: ModelParameter
    """d_T, between the foot and the first increment."""
    top_mass: ModelParameter
    """M_T, gearbox, motor and battery at the point T."""
    rotor_mass: ModelParameter
    """M_R, the eccentric mass."""
    rotor_arm_mass: ModelParameter
    """M_R_arm, a slender rod from T to the eccentric mass."""
    rotor_radius: ModelParameter
    """L_R, from T to the eccentric mass."""
    friction_slide: ModelParameter
    """mu_slide."""
    friction_stick: ModelParameter
    """mu_stick."""
    friction_threshold: ModelParameter
    """v_th, the speed below which a sliding corner locks."""
    ground_stiffness: ModelParameter
    """k_z at each corner, eq. 3.1."""
    ground_damping: ModelParameter
    """d_z at each corner, eq. 3.1."""
    ground_stiffness_y: ModelParameter
    """k_y at each corner, eq. 3.3."""
    ground_damping_y: ModelParameter
    """d_y at each corner, eq. 3.3."""
    gravity: ModelParameter

    @field_validator("*", mode="after")
    @classmethod
    def _check(cls, parameter: ModelParameter, info: ValidationInfo) -> ModelParameter:
        name = str(info.field_name)
        if parameter.unit != UNITS[name]:
            raise ValueError(f"unit is {parameter.unit!r}; it must be {UNITS[name]!r}")
        wanted = value_fault(name, parameter.value)
        if wanted is not None:
            raise ValueError(
                f"{parameter.value:g} {parameter.unit} is impossible; it must be {wanted}"
            )
        return parameter


class EffectEntry(Section):
    """A named cause that extends the model."""

    name: str
    parameters: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = {}
    """Quantity -> value, SI; one that is not given is zero, which is its absence."""
    standard_errors: dict[str, Annotated[float, Field(ge=0)]] = {}
    diagnosis: str | None = None
    """The diagnosis it came from."""


class ModelFile(Section):
    """A model: parameters plus zero or more effects."""

    schema_: Annotated[Literal["workbench/model-1"], Field(alias="schema")]
    name: str
    parameters: Parameters
    increments: Annotated[int, Field(ge=4, le=128)] = 16
    """Of the simulated beam; the values above stay those of a chain of 16."""
    effects: tuple[EffectEntry, ...] = ()

    def values(self) -> dict[str, float]:
        """Return the plain values by name, SI."""
        return {name: getattr(self.parameters, name).value for name in UNITS}

    def quantities(self) -> dict[str, dict[str, float]]:
        """Return the effects' quantities by effect."""
        return {effect.name: dict(effect.parameters) for effect in self.effects}
