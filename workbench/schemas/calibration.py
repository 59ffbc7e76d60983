"""The motor's speed-voltage line, used only where it was measured; `workbench/calibration-1`."""

from __future__ import annotations

import json
from datetime import date
from typing import Annotated, Literal

from pydantic import Field

from workbench.errors import InputError
from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section

__all__ = ["Calibration", "CalibrationFile", "MotorLine", "calibration_text"]

Slope = Annotated[float, UnitQuantity("speed_per_voltage")]
Speed = Annotated[float, UnitQuantity("speed")]


class MotorLine(Section):
    """omega = slope U + offset between two voltages (thesis, eq. 5.7); never extrapolated."""

    id: Annotated[str, Field(min_length=1)]
    """Name under which bundles refer to it."""
    slope: Annotated[float, UnitQuantity("speed_per_voltage", above=0)]
    offset: Speed
    lowest: Annotated[float, UnitQuantity("voltage", above=0)]
    """Lowest voltage that was measured."""
    highest: Annotated[float, UnitQuantity("voltage", above=0)]
    """Highest voltage that was measured."""

    def speed(self, volts: float) -> float:
        """Return the rotor's speed [rad/s] at a voltage [V]; zero when the supply gives nothing.

        Raises:
            InputError: outside the measured range.
        """
        if volts == 0:
            return 0.0
        self._check(volts, f"{volts:g} V")
        return self.slope * volts + self.offset

    def voltage(self, speed: float) -> float:
        """Return the voltage [V] for a speed [rad/s], not yet rounded to what the supply can set.

        Raises:
            InputError: outside the measured range.
        """
        volts = (speed - self.offset) / self.slope
        self._check(volts, f"{speed:g} rad/s needs {volts:.3f} V, which")
        return volts

    def _check(self, volts: float, who: str) -> None:
        if not self.lowest <= volts <= self.highest:
            raise InputError(
                f"{who} is outside the range of calibration {self.id!r}: "
                f"{self.lowest:g} V to {self.highest:g} V, that is "
                f"{self.slope * self.lowest + self.offset:.2f} rad/s to "
                f"{self.slope * self.highest + self.offset:.2f} rad/s; it is not extrapolated"
            )


class Calibration(MotorLine):
    """A line that is stated in another file; the thesis' own, where nothing is said."""

    id: Annotated[str, Field(min_length=1)] = "thesis"
    measured_on: Annotated[date | None, Field(alias="date")] = None
    slope: Annotated[float, UnitQuantity("speed_per_voltage", above=0)] = 4.4
    offset: Speed = -2.9
    lowest: Annotated[float, UnitQuantity("voltage", above=0)] = 1.0
    highest: Annotated[float, UnitQuantity("voltage", above=0)] = 5.5


class CalibrationFile(MotorLine):
    """A line with what it was measured from; `workbench calibrate` writes it."""

    schema_: Annotated[Literal["workbench/calibration-1"], Field(alias="schema")]
    measured_on: Annotated[date, Field(alias="date")]
    """Day of the last run."""
    slope_interval: tuple[Slope, Slope]
    """Holds the true slope with 90 %."""
    offset_interval: tuple[Speed, Speed]
    """Holds the true offset with 90 %."""
    scatter: Annotated[float, UnitQuantity("speed", low=0)]
    """Standard deviation from run to run about the line."""
    runs: Annotated[tuple[str, ...], Field(min_length=1)]
    """Bundles that the line was fitted to."""
    warnings: tuple[str, ...] = ()
    """What speaks against a straight line that holds all day."""


def calibration_text(file: CalibrationFile) -> str:
    """Return a calibration file as YAML, quantities with their units."""
    low, high = file.slope_interval
    below, over = file.offset_interval
    lines = [
        "schema: workbench/calibration-1",
        f"id: {json.dumps(file.id, ensure_ascii=False)}",
        f"date: {file.measured_on.isoformat()}",
        f"slope: {file.slope:.6g} rad/s/V",
        f"slope_interval: [{low:.6g} rad/s/V, {high:.6g} rad/s/V]",
        f"offset: {file.offset:.6g} rad/s",
        f"offset_interval: [{below:.6g} rad/s, {over:.6g} rad/s]",
        f"lowest: {file.lowest:.6g} V",
        f"highest: {file.highest:.6g} V",
        f"scatter: {file.scatter:.3g} rad/s",
        *_listed("runs", file.runs),
        *_listed("warnings", file.warnings),
    ]
    return "\n".join(lines) + "\n"


def _listed(key: str, texts: tuple[str, ...]) -> list[str]:
    """Return a list of texts in YAML; a JSON string is one in YAML too, whatever it holds."""
    if not texts:
        return []
    return [f"{key}:", *(f"  - {json.dumps(text, ensure_ascii=False)}" for text in texts)]
