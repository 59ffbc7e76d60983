"""What the cameras make of a motion: noise of two kinds, gaps, glitches, faults of the sensor.

Noise A: white, 0.3 mm in every coordinate. Noise B: an autoregression of 0.8 with 0.3 mm, the rotor
0.6 mm; 0.5 % of the samples are glitches of centimetres, 1 % lie in gaps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.bank.courses import RATE_HZ, TIP
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import unwrapped

__all__ = ["FAULTS", "NOISE_M", "Fault", "Filmed", "Noise", "film"]

Array = NDArray[np.float64]
Noise = Literal["A", "B"]
Fault = Literal[
    "none", "late_rotor", "tilt", "swapped_axes", "wrong_scale", "swapped_labels", "slipped_marker"
]
FAULTS: tuple[Fault, ...] = ("late_rotor", "tilt", "swapped_axes", "wrong_scale", "swapped_labels")
"""Those of the block `sensor`; a slipped marker is a trap."""

NOISE_M = 3e-4
_ROTOR_M = 6e-4
_MEMORY = 0.8
_GLITCHES, _GLITCH_M = 0.005, 0.02
_GAPS, _GAP_SAMPLES = 0.01, 5
REST_S = 1.0

_TILT_RAD = 0.05
_SCALE = 1.04
_LATE_SAMPLES = 3
_SLIP_M = 0.006


@dataclass(frozen=True, eq=False)
class Filmed:
    """One run as the cameras saw it, n samples with a second of rest first.

    Args:
        times: (n,) zero where the motion began, as far as is known [s].
        paths: body -> (n, 3) place [m], NaN where it was not seen.
        angles: body -> (n,) turn about +y from its rest [rad].
    """

    times: Array
    paths: dict[str, Array]
    angles: dict[str, Array]

    @property
    def rotor_angle(self) -> Array:
        """Return the angle of the rotor about T, (n,) [rad], NaN where either was not seen."""
        arm = self.paths["rotor"] - self.paths["top"]
        return unwrapped(self.times, np.arctan2(-arm[:, 2], arm[:, 0])).angle


def film(
    motion: TimeSeries, noise: Noise, rng: np.random.Generator, fault: Fault = "none"
) -> Filmed:
    """Return what the cameras make of a motion; the same seed gives the same pictures.

    Args:
        motion: noise-free, from time zero.
        noise: which kind.
        rng: of noise, gaps and glitches.
        fault: of the sensor, in this run.
    """
    rest = round(REST_S * RATE_HZ)
    index = np.concatenate([np.zeros(rest, dtype=int), np.arange(len(motion))])
    before = motion.times[0] - np.arange(rest, 0, -1) / RATE_HZ
    times = np.concatenate([before, motion.times])
    names = {"foot": FOOT, "top": TOP, "rotor": ROTOR}
    paths = {body: motion.select(name).values[index] for body, name in names.items()}
    angles = {
        "foot": motion[PITCH][index],
        "top": motion[TIP][index],
        "rotor": motion[ROTOR_ANGLE][index],
    }
    paths = _faulty(paths, fault)
    for body, path in paths.items():
        path += _noise(path.shape, noise, _ROTOR_M if body == "rotor" else NOISE_M, rng)
        if noise == "B":
            _disturb(path, rest, rng)
    return Filmed(times, paths, angles)


def _noise(shape: tuple[int, ...], kind: Noise, rotor: float, rng: np.random.Generator) -> Array:
    white = rng.standard_normal(shape)
    if kind == "A":
        return NOISE_M * white
    fresh = np.sqrt(1 - _MEMORY**2)
    return rotor * np.asarray(lfilter([fresh], [1, -_MEMORY], white, axis=0))


def _disturb(path: Array, rest: int, rng: np.random.Generator) -> None:
    """Put glitches and gaps into a path; the first pictures stay whole."""
    count = len(path)
    wild = np.flatnonzero(rng.random(count) < _GLITCHES)
    path[wild[wild > rest // 2]] += rng.uniform(-_GLITCH_M, _GLITCH_M, 3)
    for _ in range(rng.poisson(_GAPS * count / _GAP_SAMPLES)):
        start = rng.integers(rest // 2, count)
        path[start : start + rng.geometric(1 / _GAP_SAMPLES)] = np.nan


def _faulty(paths: dict[str, Array], fault: Fault) -> dict[str, Array]:
    """Return the paths as a faulty set-up shows them; always copies."""
    if fault == "wrong_scale":
        return {body: _SCALE * path for body, path in paths.items()}
    if fault == "tilt":
        c, s = np.cos(_TILT_RAD), np.sin(_TILT_RAD)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        return {body: path @ turn.T for body, path in paths.items()}
    if fault == "swapped_axes":
        return {body: path[:, [2, 1, 0]] for body, path in paths.items()}
    paths = {body: path.copy() for body, path in paths.items()}
    half = slice(len(paths["top"]) // 2, None)
    if fault == "late_rotor":
        paths["rotor"][_LATE_SAMPLES:] = paths["rotor"][:-_LATE_SAMPLES].copy()
    if fault == "swapped_labels":
        top = paths["top"][half].copy()
        paths["top"][half], paths["rotor"][half] = paths["rotor"][half], top
    if fault == "slipped_marker":
        paths["top"][half, 0] += _SLIP_M
    return paths
