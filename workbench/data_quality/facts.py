"""Plain facts of runs: what was measured, and what shows that it is not so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Facts", "Fault"]


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
