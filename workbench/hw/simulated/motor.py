"""The motor on a simulated supply's terminals."""

from __future__ import annotations

__all__ = ["draw_current"]


def draw_current(volts: float) -> float:
    """Return the motor's current [A] at a voltage [V]: an FA-130 with gearbox, lightly loaded.

    The maker's no-load current of 0.2 A, and friction that grows with speed.
    """
    return 0.0 if volts <= 0 else 0.2 + 0.03 * volts
