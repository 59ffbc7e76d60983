"""All effects by name."""

from __future__ import annotations

from collections.abc import Mapping

from workbench.errors import InputError, did_you_mean
from workbench.sim.effects import (
    dissipation,
    drive,
    ground,
    mass,
    numerics,
    outside,
    sensor,
    structure,
)
from workbench.sim.effects.effect import Effect

__all__ = ["EFFECTS", "effect_named", "effect_values"]

_GROUPS = (structure, dissipation, mass, drive, ground, outside, sensor, numerics)

EFFECTS: dict[str, Effect] = {effect.name: effect for group in _GROUPS for effect in group.EFFECTS}
"""Name -> effect, in the order of the groups, which is that in which effects act."""


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
