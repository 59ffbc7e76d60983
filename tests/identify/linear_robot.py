"""A robot of two linear oscillators, driven from rest by an unbalance: all of it in closed form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.fit import MeasuredRun
from workbench.motion import ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries

RATE = 120.0
REST = (0.1, 0.0, 0.27)


class Oscillator(NamedTuple):
    """w0 [rad/s], zeta, and T's motion along (x, z) for a unit of the unbalance [m]."""

    w0: float
    ratio: float
    along: tuple[float, float]

    def answer(self, w: float) -> complex:
        return w**2 / (self.w0**2 - w**2 + 2j * self.ratio * self.w0 * w)


SWAY = Oscillator(10.0, 0.01, (4e-3, 1e-3))
BOUNCE = Oscillator(18.0, 0.015, (-1e-3, 4e-3))
MODES = (SWAY, BOUNCE)


def answer(w: float) -> NDArray[np.complex128]:
    """T's answer along x and z to cos(w t), (2,) [m]."""
    return sum((mode.answer(w) * np.array(mode.along) for mode in MODES), np.zeros(2, complex))


def path(t: NDArray[np.float64], w: float) -> NDArray[np.float64]:
    """T's way from rest at t = 0, (n, 2) [m]: the answer and the swings that its start leaves."""
    out = np.zeros((len(t), 2))
    for mode in MODES:
        steady = mode.answer(w)
        decay = mode.ratio * mode.w0
        damped = np.sqrt(mode.w0**2 - decay**2)
        cosine = -steady.real  # so that way and velocity are zero at t = 0
        sine = (w * steady.imag + decay * cosine) / damped
        own = np.exp(-decay * t) * (cosine * np.cos(damped * t) + sine * np.sin(damped * t))
        out += np.outer(np.real(steady * np.exp(1j * w * t)) + own, mode.along)
    return out


def driven(
    w: float, seconds: float = 10.0, noise: float = 3e-4, seed: int = 0, name: str = ""
) -> MeasuredRun:
    """A clamped run at one speed, from rest; the rotor is at its speed at once."""
    t = np.arange(0, seconds, 1 / RATE)
    rng = np.random.default_rng(seed)
    top = path(t, w) + rng.normal(0, noise, (len(t), 2))
    columns = {
        TOP[0]: REST[0] + top[:, 0],
        TOP[1]: np.zeros(len(t)),
        TOP[2]: REST[2] + top[:, 1],
        ROTOR_ANGLE: w * t + rng.normal(0, noise / 0.035, len(t)),
    }
    return MeasuredRun(
        name or f"run-{w:g}", "clamped", TimeSeries.of(t, columns), ((0.0, w), (seconds, 0.0))
    )


def released(
    seconds: float = 10.0,
    pull: float = 0.015,
    noise: float = 3e-4,
    seed: int = 0,
    friction: float = 0.0,
    name: str = "",
) -> MeasuredRun:
    """A ring-down; `friction` adds a damping ratio in inverse proportion to the amplitude [m]."""
    t = np.arange(0, seconds, 1 / RATE)
    top = np.random.default_rng(seed).normal(0, noise, (len(t), 2))
    for mode, size in zip(MODES, (pull, pull / 3), strict=True):
        decay = mode.ratio * mode.w0
        lost = friction * mode.w0 / decay  # da/dt = -decay a - friction w0
        amplitude = np.maximum((size + lost) * np.exp(-decay * t) - lost, 0)
        along = np.array(mode.along) / np.linalg.norm(mode.along)
        top += np.outer(amplitude * np.cos(np.sqrt(mode.w0**2 - decay**2) * t), along)
    columns = {TOP[0]: REST[0] + top[:, 0], TOP[1]: np.zeros(len(t)), TOP[2]: REST[2] + top[:, 1]}
    return MeasuredRun(name or f"ring-{pull:g}", "decay", TimeSeries.of(t, columns), pull=pull)
