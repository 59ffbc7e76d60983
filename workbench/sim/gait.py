"""Gait of a simulated robot: hops, stride, slip, power and the cost of transport."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT
from workbench.sim.simulate import Simulation

__all__ = ["Gait", "gait"]

_RISEN_M = 0.002


class Gait(NamedTuple):
    """Gait over the driven time.

    Args:
        hops: times that the foot's centre rose by more than 2 mm. The thesis' first shape rocks:
            its front and rear corners leave the ground in turn.
        stride_m: forward travel a hop.
        airborne: share of the time without a corner on the ground.
        slip_per_hop_m: distance that the foot slid while a corner in contact was not sticking.
        mean_power_W: of the motor; negative power is not counted, nothing stores it.
        cost_of_transport: mean power over weight and speed, the specific resistance of the thesis'
            introduction; NaN when the robot did not travel.
    """

    hops: int
    stride_m: float
    airborne: float
    slip_per_hop_m: float
    mean_power_W: float
    cost_of_transport: float


def gait(simulation: Simulation, duration: float) -> Gait:
    """Return the gait from time zero to `duration` [s]; zeros where there is no ground."""
    motion = simulation.motion.between(0.0, duration)
    power = float(np.mean(np.maximum(motion["motor_power_W"], 0.0)))
    if "corners_touching" not in motion:
        return Gait(0, 0.0, 0.0, 0.0, power, float("nan"))
    x, airborne = motion[FOOT[0]], motion["corners_touching"] == 0
    risen = motion[FOOT[2]] > _RISEN_M
    hops = int(np.count_nonzero(risen[1:] & ~risen[:-1]))
    travelled, seconds = float(x[-1] - x[0]), float(motion.times[-1] - motion.times[0])
    slip = _slip(x, motion["corners_sliding"] > 0)
    per_hop = 1 / hops if hops else 0.0
    forward = travelled / seconds if seconds else 0.0
    cost = power / (simulation.weight_N * forward) if forward > 0 else float("nan")
    airborne_share = float(airborne.mean())
    return Gait(hops, travelled * per_hop, airborne_share, slip * per_hop, power, cost)


def _slip(x: NDArray[np.float64], sliding: NDArray[np.bool_]) -> float:
    return float(np.abs(np.diff(x))[sliding[1:] & sliding[:-1]].sum())
