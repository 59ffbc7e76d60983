"""What is seen of a state: the channels of a run, from places, joints and their rates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

__all__ = ["Observation", "Pose"]

Array = NDArray[np.float64]


class Pose(NamedTuple):
    """Where a robot is; fields as those of MjData.

    Args:
        qpos: (nq,) [m, rad].
        xpos: (nbody, 3) [m].
        xmat: (nbody, 9).
    """

    qpos: Array
    xpos: Array
    xmat: Array


@dataclass(frozen=True, eq=False)
class Observation:
    """What is seen of a state, x the places of points on bodies.

        y = p + pick_rate qvel + bias - delay dp/dt,   p = mix x + pick qpos

    Args:
        bodies: (p,) of the points.
        offsets: (p, 3) in the bodies' frames [m].
        mix: (c, 3 p) [unit of the channel by m].
        pick: (c, nq) [unit of the channel by that of qpos].
        bias: (c,) [unit of the channel].
        pick_rate: (c, nv) [unit of the channel by that of qvel]; None where no rate is seen.
        delay: (c,) [s]; None where nothing is seen late.
    """

    bodies: NDArray[np.int64]
    offsets: Array
    mix: Array
    pick: Array
    bias: Array
    pick_rate: Array | None = None
    delay: Array | None = None

    def of(self, data: mujoco.MjData | Pose) -> Array:
        """Return what is seen of a state without rates, (c,) [unit of the channel]."""
        turns = data.xmat[self.bodies].reshape(-1, 3, 3)
        points = data.xpos[self.bodies] + np.einsum("pij,pj->pi", turns, self.offsets)
        return np.asarray(self.mix @ points.ravel() + self.pick @ data.qpos + self.bias)

    @property
    def rates(self) -> Array:
        """Return pick_rate, zeros where no rate is seen, (c, nv) [as `pick_rate`]."""
        return np.zeros_like(self.pick) if self.pick_rate is None else self.pick_rate

    @property
    def delays(self) -> Array:
        """Return delay, zeros where nothing is seen late, (c,) [s]."""
        return np.zeros(len(self.bias)) if self.delay is None else self.delay
