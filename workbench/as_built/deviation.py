"""Compare a beam as it was bent with its target, joint by joint and at the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.photo import AsBent
from workbench.schemas import ShapeFile
from workbench.shape import Arcs, equal_length_arcs

__all__ = ["Deviation", "deviation_of"]

Array = NDArray[np.float64]

_LEAST_CORRECTION_RAD = np.radians(1.0)  # a hand does not bend finer
_SURE = 2.0  # standard errors


@dataclass(frozen=True, eq=False)
class Deviation:
    """How a beam differs from its target.

    Args:
        target: (16,) angles that the free strip should have [rad].
        bent: (16,) angles that it has [rad].
        error: (16,) standard errors of these [rad]; None when they are not known.
        foot_seen: whether alpha_0 was measured; else it is the target's and shows nothing.
        length: of the beam [m].
    """

    target: Array
    bent: Array
    error: Array | None
    foot_seen: bool
    length: float

    @property
    def difference(self) -> Array:
        """Return bent less target, (16,) [rad]."""
        return self.bent - self.target

    @property
    def correct(self) -> tuple[int, ...]:
        """Return the joints to correct, those that are surely off by what a hand can mend first."""
        error = np.zeros(len(self.bent)) if self.error is None else self.error
        size = np.abs(self.difference)
        off = size > np.maximum(_LEAST_CORRECTION_RAD, _SURE * error)
        off[0] &= self.foot_seen
        return tuple(int(k) for k in np.argsort(-size) if off[k])

    def arcs(self) -> tuple[Arcs, Arcs]:
        """Return the centrelines of target and beam, both from the root at the origin [m]."""
        both = (equal_length_arcs(one, self.length) for one in (self.target, self.bent))
        target, bent = both
        return target, bent

    @property
    def tip_error(self) -> Array:
        """Return tip of the beam less that of the target, both from the root, (2,) [m]."""
        target, bent = (arcs.points_at(arcs.length) for arcs in self.arcs())
        return bent - target

    def in_words(self, joint: int) -> str:
        """Return what to do at a joint: by how much, and which way."""
        degrees = float(np.degrees(-self.difference[joint]))
        way = "close" if degrees > 0 else "open"
        return f"{way} by {abs(degrees):.1f}\N{DEGREE SIGN}"


def deviation_of(bent: AsBent, target: ShapeFile) -> Deviation:
    """Return how a beam differs from its target.

    Args:
        bent: as it was read.
        target: of the free strip.
    """
    return Deviation(
        np.array(target.angles), bent.angles, bent.uncertainty, bent.foot_seen, target.length
    )
