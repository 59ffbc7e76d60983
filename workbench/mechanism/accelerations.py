"""Accelerations as channels: each is compared as the speed that it adds up to.

An observer predicts places and speeds, and white noise of an acceleration adds up to noise that
keeps what it was: w[k] = m w[k-1] + T n[k], n the acceleration's and T the time between samples.
Whitened by its memory m the channel is the acceleration again, but for the slowest motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy

from workbench.fit import Channel, MjcfRun

__all__ = ["accelerometer", "added_up"]

_MEMORY = 0.995  # of one would be drift without end, for which there is no stationary observer


def accelerometer(name: str, joint: str, sigma: float, sample_s: float) -> Channel:
    """Return the channel of a joint's acceleration.

    Args:
        name: as it is reported.
        joint: that it measures.
        sigma: standard deviation of its noise [rad/s^2 or m/s^2].
        sample_s: from one sample to the next [s].
    """
    added = sigma * sample_s / np.sqrt(1 - _MEMORY**2)
    return Channel(name, "speed", joint, sigma=float(added), memory=_MEMORY)


def added_up(run: MjcfRun, joints: Mapping[int, str]) -> MjcfRun:
    """Return a run whose accelerations are speeds, from that of their joint at the start.

    Args:
        run: with accelerations [rad/s^2 or m/s^2].
        joints: column of its values that is an acceleration -> the joint it is of.
    """
    values = run.values.copy()
    for column, joint in joints.items():
        seen = np.isfinite(values[:, column])
        spline = scipy.interpolate.CubicSpline(run.times[seen], values[seen, column])
        whole = spline.antiderivative()
        begun = run.start[joint].speed if joint in run.start else 0.0
        speed = begun + whole(run.times) - whole(run.times[0])
        values[:, column] = np.where(seen, speed, np.nan)
    return replace(run, values=values)
