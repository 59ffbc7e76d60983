"""The noise of each channel, and residuals freed from it.

Cameras' noise hangs together in time. It is taken for a process that remembers its last sample
(autoregressive of first order), known from the samples at rest. A whitened residual is what a
sample says beyond what the one before it said already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.rig import Observed

__all__ = ["Noise", "coloured", "noise_of", "whitened"]

_LEAST_REST = 30  # samples that tell a channel's noise
_MOST_MEMORY = 0.97
_NORMAL = 1.4826  # standard deviation over median deviation
_LEAST = {"m": 2e-5, "rad": 5e-4}  # what cameras resolve at best


@dataclass(frozen=True, eq=False)
class Noise:
    """The noise of the channels of one run.

    Args:
        sigma: (c,) standard deviation, in the channels' units.
        memory: (c,) correlation of neighbouring samples.
    """

    sigma: NDArray[np.float64]
    memory: NDArray[np.float64]


def noise_of(runs: Sequence[Observed], sound: Sequence[int] | None = None) -> list[Noise]:
    """Return the noise of each run; channels of one name share what all runs' rest tells.

    Args:
        runs: all of them.
        sound: those that tell noise; None takes all.
    """
    told = runs if sound is None else [runs[k] for k in sound]
    pooled: dict[str, tuple[float, float]] = {}
    for name in dict.fromkeys(channel for run in runs for channel in run.channels):
        having = [run for run in told if name in run.channels]
        pooled[name] = _pooled(name, having or [run for run in runs if name in run.channels])
    return [
        Noise(
            np.array([pooled[channel][0] for channel in run.channels]),
            np.array([pooled[channel][1] for channel in run.channels]),
        )
        for run in runs
    ]


def whitened(
    residual: NDArray[np.float64], valid: NDArray[np.bool_], noise: Noise
) -> NDArray[np.float64]:
    """Return a residual, or any change of the prediction, in independent units of noise.

    Args:
        residual: (n, c) or (n, c, k) in the channels' units.
        valid: (n, c); what was not seen becomes zero.
        noise: of the run.

    Returns:
        The same shape. A sample after one that was not seen stands for itself alone.
    """
    extra = (None,) * (residual.ndim - 2)
    seen = valid[(..., *extra)]
    scaled = np.where(seen, residual / noise.sigma[(slice(None), *extra)], 0.0)
    memory = noise.memory[(slice(None), *extra)]
    out = scaled.copy()
    both = seen[1:] & seen[:-1]
    fresh = (scaled[1:] - memory * scaled[:-1]) / np.sqrt(1 - memory**2)
    out[1:] = np.where(both, fresh, scaled[1:])
    return out


def coloured(
    white: NDArray[np.float64], valid: NDArray[np.bool_], noise: Noise
) -> NDArray[np.float64]:
    """Return what `whitened` was made of, in noise deviations.

    What cameras remember, a slow change hides in: it has its size here, and less weight there.

    Args:
        white: (n, c) or (n, c, k) as `whitened` returned it.
        valid: (n, c) that it was given.
        noise: of the run.

    Returns:
        The same shape; zero where nothing was seen.
    """
    if not noise.memory.any():
        return white
    extra = (None,) * (white.ndim - 2)
    seen = valid[(..., *extra)]
    memory = noise.memory[(slice(None), *extra)]
    fresh = np.sqrt(1 - memory**2)
    both = seen[1:] & seen[:-1]
    out = white.copy()
    for k in range(1, len(out)):  # each sample needs the one before it
        out[k] = np.where(both[k - 1], memory * out[k - 1] + fresh * white[k], white[k])
    return out


def _pooled(name: str, runs: Sequence[Observed]) -> tuple[float, float]:
    """Return deviation and memory of a channel."""
    rests, unit = [], ""
    for run in runs:
        k = run.channels.index(name)
        unit = run.units[k]
        rest = run.rest[:, k]
        seen = rest[np.isfinite(rest)]
        if len(seen) >= _LEAST_REST:
            rests.append(rest - np.median(seen))
    least = _LEAST.get(unit, 1e-12)
    if not rests:
        return max(_of_motion(name, runs), least), 0.0
    square = np.concatenate([rest[np.isfinite(rest)] ** 2 for rest in rests])
    sigma = _NORMAL * float(np.sqrt(np.median(square)))
    if sigma < least:
        return max(_of_motion(name, runs), least), 0.0
    limit = 4 * sigma  # a glitch at rest tells nothing of the noise beside it
    clipped = [np.clip(rest, -limit, limit) for rest in rests]
    near = np.concatenate([rest[1:] * rest[:-1] for rest in clipped])
    near = near[np.isfinite(near)]
    memory = float(near.mean() / np.nanmean(np.concatenate(clipped) ** 2)) if len(near) else 0.0
    if memory < 3 / np.sqrt(max(len(near), 1)):
        memory = 0.0
    return sigma, min(memory, _MOST_MEMORY)


def _of_motion(name: str, runs: Sequence[Observed]) -> float:
    """Return the deviation of white noise, from third differences: smooth motion has none."""
    thirds = []
    for run in runs:
        k = run.channels.index(name)
        third = np.diff(np.where(run.valid[:, k], run.values[:, k], np.nan), 3)
        thirds.append(np.abs(third[np.isfinite(third)]))
    every = np.concatenate(thirds)
    return _NORMAL * float(np.median(every)) / np.sqrt(20) if len(every) else 0.0
