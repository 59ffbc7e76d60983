"""What a motor with a lag makes of commands, for simulated runs."""

from __future__ import annotations

import numpy as np

from workbench.fit import commanded_angle

__all__ = ["commanded_speed"]


def commanded_speed(
    times: np.ndarray, steps: tuple[tuple[float, float], ...], gain: float, lag: float
) -> np.ndarray:
    """Return the speeds that turn a rotor by `commanded_angle` from sample to sample, (n,) [rad/s].

    Args:
        times: (n,) evenly spaced samples of a simulation [s].
        steps: as commanded.
        gain: true over commanded speed.
        lag: [s].
    """
    turned = np.diff(commanded_angle(times, steps, gain, lag, 0.0)) / np.diff(times)
    return np.append(turned, turned[-1])
