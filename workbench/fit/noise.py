"""Noise with a memory: what all runs show of it together, at rest before they begin.

    memory = sum v[k] v[k+1] / sum v[k]^2

One second of rest shows it to a tenth, all runs of a day to a few hundredths; the cameras were the
same. Noise that is taken for white where it has a memory looks like a force that is missing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.fit.measured import MeasuredRun
from workbench.noise import robust_sigma

__all__ = ["Coloured", "coloured_noise"]

Array = NDArray[np.float64]

_FARTHEST = 5.0  # deviations; what is beyond is no noise
_LEAST = 0.2  # memory that matters: information of a sum is a third less
_SURE = 3.0  # deviations of a memory that is found where there is none
_MOST = 0.95


class Coloured(NamedTuple):
    """Noise of a channel that has a memory.

    Args:
        sigma: standard deviation [m] or [rad].
        memory: correlation of neighbouring samples.
    """

    sigma: float
    memory: float


def coloured_noise(runs: Sequence[MeasuredRun]) -> Mapping[str, Coloured]:
    """Return the channels whose noise has a memory that matters -> that noise."""
    found = {}
    for name in dict.fromkeys(name for run in runs for name in run.motion.names):
        pieces = [_rest_of(run, name) for run in runs if name in run.motion]
        here = np.concatenate([piece[:-1] for piece in pieces])
        after = np.concatenate([piece[1:] for piece in pieces])
        pairs = np.isfinite(here) & np.isfinite(after)
        power = float(here[pairs] @ here[pairs])
        if power == 0:
            continue
        memory = float(here[pairs] @ after[pairs]) / power
        if memory > max(_LEAST, _SURE / np.sqrt(pairs.sum())):
            sigma = np.sqrt(power / pairs.sum())
            found[name] = Coloured(float(sigma), min(memory, _MOST))
    return found


def _rest_of(run: MeasuredRun, channel: str) -> Array:
    """Return a channel's noise before time zero, (n,), NaN where not seen or far off."""
    still = run.motion.between(-np.inf, 0.0)
    seen = np.where(still.validity(channel), still[channel], np.nan)
    if not np.isfinite(seen).any():
        return seen
    noise = seen - np.nanmedian(seen)
    noise[np.abs(np.nan_to_num(noise)) > _FARTHEST * robust_sigma(noise)] = np.nan
    return noise - np.nanmean(noise) if np.isfinite(noise).any() else noise
