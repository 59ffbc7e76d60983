"""How the cameras see the robot: shared by the bench file and the sheet."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.protocol.quantity import Quantity
from workbench.protocol.section import Section

__all__ = ["Bodies", "ExportAxes", "Marker"]

Direction = Literal["x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"]
Marker = Annotated[tuple[float, float, float], Field(description="forward, left, up in mm")]


class ExportAxes(Section):
    """How the export's axes lie on the bench; the default suits a Y-up export facing -z."""

    up: Direction = "y"
    """The export's axis that points up."""
    forward: Direction = "-z"
    """The export's axis that points in the hopping direction."""
    rate: Annotated[float, Quantity("rate", above=0, high=2000)] | None = None
    """The cameras' rate; by default the one that the export states."""

    @model_validator(mode="after")
    def _not_parallel(self) -> ExportAxes:
        if self.up[-1] == self.forward[-1]:
            raise ValueError(f"up: {self.up} and forward: {self.forward} lie on one axis")
        return self


class Bodies(Section):
    """The names of the three bodies in the export."""

    foot: str = "Foot"
    top: str = "T"
    """The body at the point T."""
    rotor: str = "Rotor"
