"""The motor in a fit: it follows the commanded speed with a lag, a gain and a delay.

A measured rotor angle cannot be replayed as it is: its noise of 10 mrad, differentiated, would
shake the robot near its resonances. A motor that lags behind its command by one time constant
needs two numbers a run, and the angle tells them to about 1e-4. What it leaves is looked at in the
residual of the angle, not hidden.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["lagged_angle", "lagged_command"]

Steps = Sequence[tuple[float, float]]


def lagged_angle(
    times: NDArray[np.float64], steps: Steps, lag: float, gain: float
) -> NDArray[np.float64]:
    """Return the angle that a motor has turned since its first command, (n,) [rad].

    Args:
        times: (n,) [s].
        steps: (time [s], commanded speed [rad/s]) in order of time; zero before the first.
        lag: time constant of the motor's speed behind its command [s].
        gain: true speed over commanded speed.
    """
    angle = np.zeros_like(times)
    before = 0.0
    for begin, speed in steps:
        since = np.maximum(times - begin, 0.0)
        angle += gain * (speed - before) * (since + lag * np.expm1(-since / lag))
        before = speed
    return angle


def lagged_command(
    times: NDArray[np.float64], steps: Steps, lag: float, gain: float
) -> NDArray[np.float64]:
    """Return the speeds that turn the rotor by `lagged_angle` from sample to sample, (n,) [rad/s].

    Args:
        times: (n,) evenly spaced samples of the simulation [s].
        steps: as commanded.
        lag: [s].
        gain: true over commanded speed.
    """
    turned = np.diff(lagged_angle(times, steps, lag, gain)) / np.diff(times)
    return np.append(turned, turned[-1])
