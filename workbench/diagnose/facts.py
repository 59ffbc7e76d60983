"""Plain facts of runs: what was measured, what shows that it is not so, and what may be made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Facts", "Fault", "ProposedRun", "repeats_from"]

_MOST_MEMORY = 0.95


@dataclass(frozen=True, eq=False)
class Facts:
    """What was measured of one run.

    Args:
        name: of the run.
        mode: what was done.
        role: `train` or `held_out`.
        channels: that are compared.
        values: (n, c) of them, NaN where not seen [unit of the channel].
    """

    name: str
    mode: str
    role: str
    channels: tuple[str, ...]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Fault:
    """What shows, before any fit, that a run is not what it is said to be.

    Args:
        run: its index.
        evidence: in a sentence, with what was said, what was measured and where to look.
    """

    run: int
    evidence: str


@dataclass(frozen=True)
class ProposedRun:
    """A run that nobody has made yet.

    Args:
        mode: what would be done.
        amount: how much of it: a speed [rad/s], a pull [N] or a height [m], by the mode.
        duration: how long the system would move [s].
        rest: still time before [s].
    """

    mode: str
    amount: float
    duration: float
    rest: float


def repeats_from(memories: Sequence[float]) -> float:
    """Return how often samples of noise repeat one another; 1 where nothing is known.

    Args:
        memories: correlations of neighbouring samples at rest.
    """
    memory = min(max(float(np.median(memories)), 0.0), _MOST_MEMORY) if memories else 0.0
    return (1 + memory) / (1 - memory)
