"""What the default search knows of a candidate before it hops: how its beam moves, if it stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.design.problem import Problem
from workbench.design.small_motions import descriptors, small_motions
from workbench.design.variables import ANGLES

__all__ = ["Description"]

# a shape beyond these by the clamped chain, whose foot does not give, surely cannot stand
_OVERHANG_M = 0.01
_SUNK_M = 0.003


class Description:
    """Describes candidates of a problem, many at once.

    Args:
        problem: that they are of.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem

    def __call__(self, candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how they move, and the variables beside the angles.

        Args:
            candidates: (n, d).

        Returns:
            Descriptors (n, f), NaN where one overhangs its foot, lies on the floor or buckles.
        """
        names = self._problem.space.names
        beside = {name: candidates[:, k] for k, name in enumerate(names) if name not in ANGLES}
        values = {**self._problem.model.values(), **beside}
        motions = small_motions(
            values,
            candidates[:, : len(ANGLES)],
            self._problem.shape.length,
            standing=self._problem.shape.state == "loaded",
        )
        described = np.column_stack([descriptors(motions), *beside.values()])
        falls = np.abs(motions.tip[:, 0]) > np.asarray(values["foot_length"]) / 2 + _OVERHANG_M
        described[falls | (motions.lowest < -_SUNK_M) | (motions.omega[:, 0] == 0)] = np.nan
        return described
