"""What the default search knows of a candidate before it hops: how its beam moves, if it falls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.design.problem import Problem
from workbench.design.small_motions import DESCRIPTORS, descriptors, small_motions, stand
from workbench.design.variables import ANGLES, SPEED
from workbench.sim import FALLEN_M

__all__ = ["Description"]

# of the drive: of 3360 hops of 10 s all 1631 beyond 0.8 m rang between 0.89 and 1.12 of it
_NEAR = 1 / 8


class Description:
    """Describes candidates of a problem, many at once.

    Args:
        problem: that they are of.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._names = problem.space.names
        self._beside = [name for name in self._names if name not in ANGLES]

    def __call__(self, candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how they move, and the variables beside the angles.

        Args:
            candidates: (n, d).

        Returns:
            Descriptors (n, f), NaN where one does not stand or reaches below its foot.
        """
        shape, values = self._problem.shape, self._values(candidates)
        how = {"length": shape.length, "standing": shape.state == "loaded"}
        angles = candidates[:, : len(ANGLES)]
        rest = stand(values, angles, **how)
        stands = (
            (np.abs(rest.tip_x) <= np.asarray(values["foot_length"]) / 2)
            & (rest.tip_z > FALLEN_M)
            & (rest.lowest > self._problem.strip.thickness / 2)
        )
        motions = small_motions(self._values(candidates[stands]), angles[stands], **how)
        beside = candidates[stands][:, [self._names.index(name) for name in self._beside]]
        described = np.full((len(candidates), len(DESCRIPTORS) + len(self._beside)), np.nan)
        described[stands] = np.column_stack([descriptors(motions), beside])
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

    def _values(self, candidates: NDArray[np.float64]) -> Mapping[str, ArrayLike]:
        beside = {name: candidates[:, self._names.index(name)] for name in self._beside}
        return {**self._problem.model.values(), **beside}
