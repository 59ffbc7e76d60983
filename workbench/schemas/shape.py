"""`workbench/shape-1`: the 16 angles of a beam."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section

__all__ = ["ShapeFile"]

Angle = Annotated[float, Field(ge=-3.2, le=3.2)]


class ShapeFile(Section):
    """A beam's shape: the angle at the foot and those between its increments."""

    schema_: Annotated[Literal["workbench/shape-1"], Field(alias="schema")]
    name: str
    angles: Annotated[tuple[Angle, ...], Field(min_length=16, max_length=16)]
    """alpha_0 to alpha_15 [rad], rotation about +y of each increment against the one before."""
    length: Annotated[float, UnitQuantity("length", above=0, high=2.0)]
    """Length of the whole beam along its centreline."""
    thickness: Annotated[float, UnitQuantity("length", above=0, high=0.01)] | None = None
    """Thickness of the strip; templates need it."""
    width: Annotated[float, UnitQuantity("length", above=0, high=0.2)] | None = None
    convention: Literal["polyline"] = "polyline"
    """Straight increments of equal length joined at the angles, as the thesis models it."""
    state: Literal["unloaded", "loaded"]
    """Whether the angles are those of the free strip or of the standing robot."""
    uncertainty: (
        Annotated[
            tuple[Annotated[float, Field(ge=0, le=3.2)], ...], Field(min_length=16, max_length=16)
        ]
        | None
    ) = None
    """Standard error of each angle [rad], where the shape was measured."""
    source: str
    """Where the angles come from."""
