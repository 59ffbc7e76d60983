"""The unit of length by the robot's size: 0.16 to 0.6 m foot to T, 0.01 to 0.2 m T to rotor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking.body_names import FOOT_TOP_M, TOP_ROTOR_M, BodyNames, guess_bodies
from workbench.tracking.take import Take

__all__ = ["UNITS", "in_plausible_unit", "in_unit", "unit_hint", "unit_name"]

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Unit of length -> metres."""
_LOOKED_AT = 2000  # samples


def in_unit(take: Take, metres: float) -> Take:
    """Return a take whose file is read in another unit of length.

    Args:
        take: the export.
        metres: in the file's true unit.
    """
    factor = metres / take.unit_m
    bodies = {
        name: replace(
            body,
            position=factor * body.position,
            measured=factor * body.measured,
            solved=factor * body.solved,
            reported_error=None if body.reported_error is None else factor * body.reported_error,
        )
        for name, body in take.bodies.items()
    }
    cloud = replace(take.cloud, position=factor * take.cloud.position)
    return replace(take, bodies=bodies, cloud=cloud, unit_m=metres)


def in_plausible_unit(take: Take, names: BodyNames) -> tuple[Take, list[str]]:
    """Return a take in the unit of length in which its bodies have the robot's size.

    Args:
        take: the export.
        names: of the robot's bodies.

    Returns:
        The take, itself where its unit is plausible or none is, and a sentence where it was not.

    Raises:
        InputError: the file states a unit, and the bodies have the robot's size in another one.
    """
    some = slice(None, None, max(1, len(take) // _LOOKED_AT))
    foot, top, rotor = (take.body_path(name, some) for name in (names.foot, names.top, names.rotor))
    sizes = _usual(top - foot), _usual(rotor - top)
    if _is_robot(sizes, 1.0):
        return take, []
    unit = next((u for u, m in UNITS.items() if _is_robot(sizes, m / take.unit_m)), None)
    if unit is None:
        return take, []
    sentence = (
        f"T is {sizes[0]:.3g} m from the foot and the rotor {sizes[1]:.3g} m from T, as the file "
        f"is read ({_stated(take)}); in {unit} that is the robot"
    )
    if take.unit_stated:
        raise InputError(f"{take.path}: {sentence}. State its unit: tracking: {{unit: {unit}}}")
    return in_unit(take, UNITS[unit]), [f"{sentence}, so it is read in {unit}"]


def unit_hint(take: Take) -> str | None:
    """Return a sentence where three bodies have the robot's size in another unit of length only."""
    if len(take.bodies) < 3 or guess_bodies(take) is not None:
        return None
    for unit, metres in UNITS.items():
        if metres != take.unit_m and guess_bodies(in_unit(take, metres)) is not None:
            return (
                f"in {unit} three bodies have the robot's size, as the file is read they have not "
                f"({_stated(take)}); state it in the sheet: tracking: {{unit: {unit}}}"
            )
    return None


def unit_name(metres: float) -> str:
    """Return the name of a unit of length, or its size [m] where it has none."""
    return next((unit for unit, m in UNITS.items() if m == metres), f"{metres:g} m")


def _stated(take: Take) -> str:
    stated = "as it states" if take.unit_stated else "it states no unit"
    return f"{unit_name(take.unit_m)}, {stated}"


def _usual(vectors: NDArray[np.float64]) -> float:
    length = np.linalg.norm(vectors, axis=1)
    length = length[np.isfinite(length)]
    return float(np.median(length)) if len(length) else float("nan")


def _is_robot(sizes: tuple[float, float], factor: float) -> bool:
    bounds = FOOT_TOP_M, TOP_ROTOR_M
    return all(a <= factor * size <= b for size, (a, b) in zip(sizes, bounds, strict=True))
