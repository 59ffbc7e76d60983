"""What a robot of the bank is put through, and what a generator of motions has to offer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np

from workbench.timeseries import TimeSeries

__all__ = ["RATE_HZ", "TIP", "Course", "Generator", "Job", "Mode", "Quantities"]

Mode = Literal["clamped", "hop", "decay", "drop"]
Quantities = Mapping[str, Mapping[str, float]]
"""Effect -> quantity -> value, SI."""

RATE_HZ = 120
TIP = "tip_rad"
"""Channel of a generated motion: turn in the world of the body that carries T, from its rest."""


class Course(NamedTuple):
    """What the robot is put through, as `workbench.motion` words it.

    Args:
        mode: clamped and hop are driven, decay is pulled and let go, drop falls.
        duration: after time zero [s].
        steps: (time [s], commanded speed of the rotor against T [rad/s]).
        start_angle: of the rotor at rest, in the world about +y from +x [rad].
        pull: forward force on T before a decay [N].
        height: of a drop [m].
        lag: time constant of the motor's speed behind its command [s].
    """

    mode: Mode
    duration: float
    steps: tuple[tuple[float, float], ...] = ()
    start_angle: float = np.pi / 2
    pull: float = 0.0
    height: float = 0.0
    lag: float = 0.05


class Job(NamedTuple):
    """One motion that is asked for.

    Args:
        values: of the model, by its names, SI.
        effects: that the robot has.
        course: what it is put through.
    """

    values: Mapping[str, float]
    effects: Quantities
    course: Course


class Generator(Protocol):
    """A source of motions."""

    def motions(self, jobs: Sequence[Job]) -> list[TimeSeries]:
        """Return channels of `workbench.motion` and `TIP` at 120 Hz from time zero, noise-free.

        Raises:
            ValueError: when a robot cannot do what is asked.
        """
        ...
