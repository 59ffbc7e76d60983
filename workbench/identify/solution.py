"""Where a fit ended, with all that is needed to judge it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.identify.problem import Problem

__all__ = ["ROBUST", "Solution", "root_mean_square"]

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
    def by_run(self) -> list[NDArray[np.float64]]:
        """Return measured less simulated over noise of each run, (n, c), NaN where not seen."""
        run = self.problem.rows.run
        return [
            np.where(
                seen.valid,
                self.residuals[run == k][len(seen.rest) :].reshape(seen.values.shape),
                np.nan,
            )
            for k, seen in enumerate(self.problem.seen)
        ]

    @property
    def misfit(self) -> float:
        """Return the root mean square of what was measured less what was simulated, over noise."""
        return root_mean_square(np.concatenate([left.ravel() for left in self.by_run]))


def root_mean_square(residuals: NDArray[np.float64]) -> float:
    """Return it over those that were seen, NaN where none was."""
    seen = residuals[np.isfinite(residuals)]
    return float(np.sqrt(np.mean(seen**2))) if len(seen) else float("nan")
