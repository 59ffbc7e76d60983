"""Where a fit ended, with all that is needed to judge it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.identify.problem import Problem

__all__ = ["ROBUST", "Solution"]

ROBUST = 3.0  # residuals beyond so many noise deviations pull less


@dataclass(frozen=True, eq=False)
class Solution:
    """Where a fit ended.

    Args:
        problem: that was solved.
        x: (u,) unknowns.
        residuals: (m,) there.
        jacobian: (m, u) there.
    """

    problem: Problem
    x: NDArray[np.float64]
    residuals: NDArray[np.float64]
    jacobian: NDArray[np.float64]

    @classmethod
    def at(cls, problem: Problem, x: NDArray[np.float64]) -> Solution:
        """Evaluate a problem where a fit ended."""
        return cls(problem, x, problem.residuals(x), problem.jacobian(x))

    @property
    def weights(self) -> NDArray[np.float64]:
        """Return how much each residual counts, (m,): less far beyond the noise; priors fully."""
        soft = 1 / np.sqrt(1 + (self.residuals / ROBUST) ** 2)
        return np.where(self.problem.rows.run < 0, 1.0, soft)

    @property
    def information(self) -> NDArray[np.float64]:
        """Return the Fisher information of the unknowns, (u, u), for noise of the stated size."""
        return self.jacobian.T @ (self.weights[:, None] * self.jacobian)

    @property
    def misfit(self) -> float:
        """Return the root mean square of what was measured less what was simulated, over noise."""
        measured = self.residuals[self.problem.rows.run >= 0]
        seen = measured[measured != 0]  # a sample that was not seen has residual zero
        return float(np.sqrt(np.mean(seen**2)))
