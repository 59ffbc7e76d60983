"""The experimental condition of one simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.schemas import Mode
from workbench.sim.drive import Drive
from workbench.sim.robot import Foot

__all__ = ["Condition"]


@dataclass(frozen=True)
class Condition:
    """Experimental condition: mode, command and start of a simulation.

    Args:
        mode: `hop` and `clamped` are driven; in `decay` the foot is fixed and T, pulled forward, is
            released at time zero; in `drop` the robot is released in the shape it has while its
            foot is held. Zero speed locks the rotor in both.
        command: (n,) of the drive from each sample to the next [unit of `drive`]; its length is
            that of the simulation.
        start_angle: of the rotor at rest, about +y from +x [rad].
        rest: time at rest before time zero [s].
        pull: force on T before the release, in mode decay, forward [N].
        height: of the fall, in mode drop [m].
        drive: `speed` [rad/s] or `torque` [N m] of the rotor against T, or `voltage` [V] of the
            motor.
        energy: whether the potential (gravity and hinges) and kinetic energy are recorded.
        pull_up: force on T before the release, in mode decay, upward [N].

    Raises:
        InputError: when there is no such mode.
    """

    mode: Mode
    command: NDArray[np.float64]
    start_angle: float = np.pi / 2
    rest: float = 0.0
    pull: float = 0.0
    height: float = 0.0
    drive: Drive = "speed"
    energy: bool = False
    pull_up: float = 0.0

    def __post_init__(self) -> None:
        """Refuse an unknown mode."""
        if self.mode not in (modes := get_args(Mode)):
            near = did_you_mean(str(self.mode), modes)
            known = f"it must be one of {', '.join(modes)}"
            raise InputError(f"mode {self.mode!r} cannot be simulated{near}; {known}")

    @property
    def foot(self) -> Foot:
        """Return whether the foot is free in the motion."""
        return "free" if self.mode in ("hop", "drop") else "fixed"
