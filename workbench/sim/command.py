"""Commands of a drive over the samples of a simulation: steps, ramps and replays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim.robot import SAMPLE_RATE_HZ

__all__ = ["replayed", "sample_times", "staircase"]


def sample_times(duration: float) -> NDArray[np.float64]:
    """Return the times of the samples that cover a duration [s], (n,) [s]."""
    count = int(np.floor(duration * SAMPLE_RATE_HZ + 1e-9)) + 1
    return np.arange(count, dtype=np.float64) / SAMPLE_RATE_HZ


def staircase(
    times: NDArray[np.float64], changes: Sequence[tuple[float, float]]
) -> NDArray[np.float64]:
    """Return a command, (n,) [unit of the drive]: each value from its time on, zero before.

    Args:
        times: (n,) [s].
        changes: (time [s], value in the drive's unit) in order of time.
    """
    begins = np.array([t for t, _ in changes])
    values = np.array([0.0] + [value for _, value in changes])
    return values[np.searchsorted(begins, times + 1e-9, side="right")]


def replayed(
    times: NDArray[np.float64], angle: NDArray[np.float64], start: float = 0.0
) -> NDArray[np.float64]:
    """Return the speed command that turns the rotor through a measured angle, (m,) [rad/s].

    The angle is that of the rotor against T, as the motor's is. Cameras see it in the world; T
    turns as well, by the foot's pitch and all hinges: angle = in the world - turn of T. Only its
    changes count: where the rotor starts is `Condition.start_angle`.

    Args:
        times: (n,) rising [s].
        angle: (n,) unwrapped [rad], about +y; gaps, NaN, are bridged by a straight line.
        start: the time that becomes the simulation's zero [s].

    Raises:
        InputError: when fewer than two samples are left after the start.
    """
    seen = np.isfinite(angle)
    at = start + sample_times(float(np.max(times[seen], initial=start)) - start)
    if len(at) < 2:
        raise InputError(
            f"nothing to replay: the rotor's angle is not seen later than {start:g} s; "
            "check the start, and that the angle has numbers"
        )
    turned = np.interp(at, times[seen], angle[seen])
    return np.append(np.diff(turned) * SAMPLE_RATE_HZ, 0.0)
