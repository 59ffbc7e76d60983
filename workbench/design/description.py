"""What the default search knows of a candidate before it hops: how its beam moves, if it falls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.design.problem import Problem
from workbench.design.small_motions import DESCRIPTORS, descriptors, small_motions
from workbench.design.variables import ANGLES, SPEED

__all__ = ["Description"]

# a shape beyond these by the clamped chain, whose foot does not give, surely cannot stand
_OVERHANG_M = 0.01
_SUNK_M = 0.003
# of the drive: of 3360 hops of 10 s all 1631 beyond 0.8 m rang between 0.89 and 1.12 of it
_NEAR = 1 / 8


class Description:
    """Describes candidates of a problem, many at once.

    Args:
        problem: that they are of.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._beside = [name for name in problem.space.names if name not in ANGLES]

    def __call__(self, candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how they move, and the variables beside the angles.

        Args:
            candidates: (n, d).

        Returns:
            Descriptors (n, f), NaN where one overhangs its foot, lies on the floor or buckles.
        """
        names = self._problem.space.names
        beside = {name: candidates[:, names.index(name)] for name in self._beside}
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

    def rings_near_drive(self, described: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return where the mode that swings T up as it goes forward rings near the drive's speed.

        Shapes of others hop badly (section 7.1 of the thesis: the mode moves towards the drive).

        Args:
            described: (n, f) as returned for candidates [unit of each].

        Returns:
            Of each, (n,).
        """
        speed: NDArray[np.float64] | float = self._problem.omega
        if SPEED in self._beside:
            speed = described[:, len(DESCRIPTORS) + self._beside.index(SPEED)]
        rising = described[:, DESCRIPTORS.index("rising")]
        return np.abs(rising - np.abs(speed)) < _NEAR * np.abs(speed)
