"""The speed-voltage line of the motor, used only where it was measured."""

from __future__ import annotations

from datetime import date
from typing import Annotated

from pydantic import Field

from workbench.errors import InputError
from workbench.protocol.quantity import Quantity
from workbench.protocol.section import Section

__all__ = ["Calibration"]


class Calibration(Section):
    """omega = slope U + offset between two voltages (thesis, eq. 5.7); never extrapolated."""

    id: str = "thesis"
    """Name under which bundles refer to it."""
    measured_on: Annotated[date | None, Field(alias="date")] = None
    slope: Annotated[float, Quantity("speed_per_voltage", above=0)] = 4.4
    offset: Annotated[float, Quantity("speed")] = -2.9
    lowest: Annotated[float, Quantity("voltage", above=0)] = 1.0
    """Lowest voltage that was measured."""
    highest: Annotated[float, Quantity("voltage", above=0)] = 5.5
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
