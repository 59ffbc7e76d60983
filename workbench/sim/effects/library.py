"""All effects by name."""

from __future__ import annotations

from collections.abc import Mapping

from workbench.errors import InputError, did_you_mean
from workbench.sim.effects import (
    air_drag,
    beam_discretisation,
    camera_tilt,
    foot_cg,
    foot_mass,
    friction_anisotropy,
    friction_level,
    ground_damping,
    ground_hunt_crossley,
    ground_slope,
    ground_stiffness,
    hinge_coulomb_friction,
    hinge_cubic_stiffness,
    hinge_damping,
    hinge_quadratic_damping,
    hinge_stiffness,
    length_scale,
    local_stiffness_loss,
    marker_offset,
    motor_droop,
    rest_shape_drift,
    root_play,
    root_stiffness,
    rotor_unbalance,
    sole_adhesion,
    speed_drift,
    speed_offset,
    speed_ripple,
    speed_scale,
    tether,
    time_offset,
    time_step,
    top_mass,
)
from workbench.sim.effects.effect import Effect

__all__ = ["EFFECTS", "effect_named", "effect_values"]

_FILES = (
    hinge_stiffness,
    root_stiffness,
    hinge_cubic_stiffness,
    root_play,
    local_stiffness_loss,
    rest_shape_drift,
    hinge_damping,
    hinge_coulomb_friction,
    hinge_quadratic_damping,
    air_drag,
    top_mass,
    foot_mass,
    foot_cg,
    rotor_unbalance,
    speed_scale,
    speed_offset,
    speed_drift,
    motor_droop,
    speed_ripple,
    ground_slope,
    ground_stiffness,
    ground_damping,
    ground_hunt_crossley,
    friction_level,
    friction_anisotropy,
    sole_adhesion,
    tether,
    camera_tilt,
    time_offset,
    length_scale,
    marker_offset,
    beam_discretisation,
    time_step,
)

EFFECTS: dict[str, Effect] = {file.EFFECT.name: file.EFFECT for file in _FILES}
"""Name -> effect, in the order of the groups."""


def effect_named(name: str) -> Effect:
    """Return an effect.

    Raises:
        InputError: when there is none of that name; lists those that exist.
    """
    if name not in EFFECTS:
        hint = did_you_mean(name, EFFECTS)
        raise InputError(f"effect {name!r} is unknown{hint}; there are {', '.join(EFFECTS)}")
    return EFFECTS[name]


def effect_values(name: str, given: Mapping[str, float]) -> dict[str, float]:
    """Return all quantities of an effect, those that are not given at zero.

    Raises:
        InputError: for an unknown effect or quantity, or one that is physically impossible.
    """
    effect = effect_named(name)
    known = {quantity.name: quantity for quantity in effect.quantities}
    for key, value in given.items():
        if key not in known:
            hint = did_you_mean(key, known)
            raise InputError(
                f"effect {name} has no quantity {key!r}{hint}; it has {', '.join(known)}"
            )
        quantity = known[key]
        if not quantity.low <= value <= quantity.high:
            raise InputError(
                f"effect {name}: {key} is {value:g} {quantity.unit}; it must lie within "
                f"{quantity.low:g} and {quantity.high:g} {quantity.unit}"
            )
    return {key: float(given.get(key, 0.0)) for key in known}
