"""How the cameras see the robot: shared by the bench file and the sheet."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section

__all__ = ["Bodies", "Exchanged", "ExportAxes", "Limits", "Marker"]

Direction = Literal["x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"]
Marker = Annotated[tuple[float, float, float], Field(description="forward, left, up in mm")]
Limits = dict[str, Annotated[float, UnitQuantity("length", above=0)]]


class ExportAxes(Section):
    """How the export's axes lie on the bench, and what it says wrongly or not at all.

    The default suits a Y-up export facing -z; an export that names its axes goes before it.
    """

    up: Direction = "y"
    """The export's axis that points up."""
    forward: Direction = "-z"
    """The export's axis that points in the hopping direction."""
    rate: Annotated[float, UnitQuantity("rate", above=0, high=2000)] | None = None
    """The cameras' rate; by default the one that the export states."""
    unit: Literal["m", "cm", "mm", "in"] | None = None
    """The export's unit of length; by default the one that it states."""

    @model_validator(mode="after")
    def _not_parallel(self) -> ExportAxes:
        if self.up[-1] == self.forward[-1]:
            raise ValueError(f"up: {self.up} and forward: {self.forward} lie on one axis")
        return self


class Exchanged(Section):
    """Two bodies that the export has the wrong way round."""

    bodies: tuple[str, str]
    """Their names in the export."""
    frames: tuple[int, int] | None = None
    """First and last frame index of the exchange; the whole take if absent."""

    @model_validator(mode="after")
    def _two(self) -> Exchanged:
        if self.bodies[0] == self.bodies[1]:
            raise ValueError(f"bodies: {self.bodies[0]} twice; an exchange has two bodies")
        if self.frames is not None and self.frames[0] > self.frames[1]:
            raise ValueError(f"frames: {self.frames[0]} comes after {self.frames[1]}")
        return self


class Bodies(Section):
    """The names of the three bodies in the export."""

    foot: str = "Foot"
    top: str = "T"
    """The body at the point T."""
    rotor: str = "Rotor"
