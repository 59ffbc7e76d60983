"""What an observer sees of a hopping robot's run, from just before its first motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.glitches import glitches
from workbench.fit.measured import MeasuredRun
from workbench.fit.noise import Coloured
from workbench.fit.soundness import rate_words
from workbench.motion import PITCH
from workbench.sim import SAMPLE_RATE_HZ

__all__ = ["SeenRun", "is_clamped", "seen_run"]

Array = NDArray[np.float64]

_KEPT = 64  # runs, some 20 kB each
_LEAD_S = 0.1  # driven runs are observed from this long before the first motion
_AFTER = {"decay": 6.5, "drop": 1.5}
"""Samples between a release and the first that is observed. The instant of a fall is known to half
a sample; that of a pulled T to the 25 ms in which 0.15 N move it out of 0.3 mm of noise."""


@dataclass(frozen=True, eq=False)
class SeenRun:
    """One run as it is observed.

    Args:
        channels: names of the c channels.
        first: sample of the run's motion that is the first observed.
        seen: (n, c) from there on, NaN where not seen or a glitch [unit of the channel].
        sigma: (c,) standard deviation of the noise [unit of the channel].
        memory: (c,) correlation of the noise with that of the sample before [1].
        rest: (c,) median before time zero [unit of the channel].
    """

    channels: tuple[str, ...]
    first: int
    seen: Array
    sigma: Array
    memory: Array
    rest: Array


def seen_run(run: MeasuredRun, coloured: Mapping[str, Coloured]) -> SeenRun:
    """Return the part of a run that is observed; refuse one without rest."""
    if wrong := rate_words(run.name, run.motion.times, 1 / SAMPLE_RATE_HZ):
        raise InputError("; ".join(wrong))
    channels = [*run.places, *([PITCH] if not is_clamped(run) and PITCH in run.motion else [])]
    values = _sound(run, tuple(channels))
    after = -_LEAD_S if run.driven else _AFTER[run.mode] / SAMPLE_RATE_HZ
    first = int(np.searchsorted(run.motion.times, after))
    still = values[run.motion.times < 0]
    missing = [name for name, one in zip(channels, still.T, strict=True) if np.isnan(one).all()]
    if missing:
        raise InputError(
            f"{run.name}: {', '.join(missing)} was not seen before time zero; a run needs some "
            "rest before its first motion"
        )
    sigma, memory = run.noise(channels), np.zeros(len(channels))
    for c, name in enumerate(channels):
        if name in coloured:
            sigma[c], memory[c] = coloured[name].sigma, coloured[name].memory
    return SeenRun(
        tuple(channels), first, values[first:], sigma, memory, np.nanmedian(still, axis=0)
    )


@lru_cache(_KEPT)
def _sound(run: MeasuredRun, channels: tuple[str, ...]) -> Array:
    """Return what was seen of some channels, (n, c), without glitches; nobody may change it."""
    part = run.motion.select(channels)
    values = np.where(part.valid & np.isfinite(part.values), part.values, np.nan)
    return np.where(glitches(values, run.noise(channels)), np.nan, values)


def is_clamped(run: MeasuredRun) -> bool:
    """Return whether the foot is held."""
    return run.mode in ("clamped", "decay")
