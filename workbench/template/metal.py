"""What a strip's metal does when it is bent."""

from __future__ import annotations

from typing import NamedTuple

from workbench.errors import InputError

__all__ = ["Metal", "metal_of"]


class Metal(NamedTuple):
    """A metal.

    Args:
        yield_strength: [Pa].
        modulus: Young's modulus [Pa].
    """

    yield_strength: float
    modulus: float


def metal_of(yield_strength: float | None, modulus: float | None) -> Metal | None:
    """Return the metal of two numbers [Pa], or None where neither is given.

    Raises:
        InputError: when one is missing, or a metal cannot have them.
    """
    if yield_strength is None and modulus is None:
        return None
    if yield_strength is None or modulus is None:
        raise InputError(
            'springback needs both: --yield and --modulus, for example "200 MPa" and "70 GPa"'
        )
    if not 0 < yield_strength < modulus / 10:
        raise InputError(
            f"no metal yields at {yield_strength / 1e6:g} MPa with a modulus of "
            f"{modulus / 1e9:g} GPa; check --yield and --modulus"
        )
    return Metal(yield_strength, modulus)
