"""What a run may be: its modes and roles. Kept apart from `motion`, which needs numpy."""

from __future__ import annotations

from typing import Literal

__all__ = ["DRIVEN", "Mode", "Role"]

Mode = Literal["hop", "clamped", "decay", "drop"]
"""What the robot does: driven on the ground or with its foot clamped; clamped, T pulled and
released; held at a height and let go."""
DRIVEN: tuple[Mode, ...] = ("hop", "clamped")
"""The modes in which the motor turns; in the others the gearbox holds the rotor."""
Role = Literal["train", "held_out"]
"""Whether a fit may see a run, or is judged by it."""
