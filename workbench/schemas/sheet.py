"""`workbench/sheet-1`: runs that were measured elsewhere."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from workbench.modes import DRIVEN
from workbench.schemas.calibration import Calibration
from workbench.schemas.experiment import Mode, Role, wrong_release
from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section
from workbench.schemas.tracking import Bodies, Exchanged, ExportAxes, Limits, Marker

__all__ = ["Sheet", "SheetRun"]

Angle = Annotated[float, Field(ge=-3.2, le=3.2)]


def _two(forces: tuple[float, ...]) -> tuple[float, ...]:
    if len(forces) != 2:
        raise ValueError("two forces are meant, forward and up: [0.3 N, -0.2 N]")
    return forces


_Force = Annotated[float, UnitQuantity("force")]
Pull = Annotated[
    Annotated[float, UnitQuantity("force", above=0), Tag("forward")]
    | Annotated[tuple[_Force, ...], AfterValidator(_two), Tag("pull")],
    Discriminator(lambda given: "pull" if isinstance(given, (list, tuple)) else "forward"),
]


class SheetRun(Section):
    """One take and what was asked of the robot in it."""

    take: str
    """Path of the export, from the sheet's folder."""
    mode: Mode
    omega: Annotated[float, UnitQuantity("speed", above=0)] | None = None
    """Commanded rotor speed."""
    voltage: Annotated[float, UnitQuantity("voltage", above=0)] | None = None
    """Supply voltage; the calibration turns it into a speed."""
    pull: Pull | None = None
    """Force on T before the release, in mode decay: forward, or `[0.3 N, -0.2 N]` forward and up;
    found in the data if absent."""
    height: Annotated[float, UnitQuantity("length", above=0, high=1)] | None = None
    """Height of the fall, in mode drop; found in the data if absent."""
    rest: Annotated[float, UnitQuantity("time", low=0)] | None = None
    """Still time before the motor starts or the tip is released; found in the data if absent."""
    ramp: Annotated[float, UnitQuantity("time", low=0)] | None = None
    duration: Annotated[float, UnitQuantity("time", above=0)] | None = None
    """Driven time, or time after the release; to the end of the take if absent."""
    role: Role = "train"
    exchanged: tuple[Exchanged, ...] = ()
    """Bodies that the tracker took for one another; most such exchanges are found in the data."""

    @model_validator(mode="after")
    def _drive(self) -> SheetRun:
        driven = {"omega": self.omega, "voltage": self.voltage}
        given = [name for name, value in driven.items() if value is not None]
        if self.mode in DRIVEN and len(given) != 1:
            raise ValueError(f"mode {self.mode} needs either omega or voltage")
        if self.mode not in DRIVEN and self.ramp is not None:
            given.append("ramp")
        if self.mode not in DRIVEN and given:
            raise ValueError(f"mode {self.mode} has no drive; remove {given[0]}")
        wrong = wrong_release(self.mode, {"pull": self.pull, "height": self.height})
        if wrong is not None:
            raise ValueError(wrong)
        return self


class Sheet(Section):
    """Takes measured elsewhere, and what is known about them."""

    schema_: Annotated[Literal["workbench/sheet-1"], Field(alias="schema")]
    model: str = "thesis"
    shape: str | tuple[Angle, ...] = "thesis-initial"
    """A name, a path, or 16 angles [rad]."""
    calibration: Calibration = Calibration()
    tracking: ExportAxes = ExportAxes()
    bodies: Bodies = Bodies()
    markers: dict[str, tuple[Marker, ...]] = {}
    limits: Limits = {}
    """By body, the greatest error of a sample that counts; as the export reports it."""
    cleaning: Literal["default", "thesis"] = "default"
    runs: Annotated[tuple[SheetRun, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _sixteen(self) -> Sheet:
        if not isinstance(self.shape, str) and len(self.shape) != 16:
            raise ValueError(f"shape: {len(self.shape)} angles; a beam has 16")
        return self
