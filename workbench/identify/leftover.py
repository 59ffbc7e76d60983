"""Whether a fit leaves more than noise: what its residuals keep from one sample to the next.

The cameras' noise is new in every sample; what a model lacks is a motion, which hardly changes in
8 ms. So half the mean square of successive differences is the noise alone, and the mean square
itself is noise and lack together. For noise alone their ratio is one, with a variance of one over
the number of residuals (von Neumann, Annals of Mathematical Statistics 12, 1941). The noise that
the residuals were scaled by, known to some percent in each channel, cancels out.

Noise of the cameras that lasts longer than a sample counts as lack. It is not the robot's, but the
intervals know of it as little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.identify.solution import Solution, root_mean_square

__all__ = ["Leftover", "leftover"]

_SURE = 3.0  # standard errors: noise alone exceeds them in one fit of 700


class Leftover(NamedTuple):
    """What a fit leaves beside what noise alone leaves, in the noise deviations of the fit.

    Args:
        misfit: root mean square of the residuals.
        noise: what noise alone leaves.
        error: standard error of the ratio of both, for noise alone.
    """

    misfit: float
    noise: float
    error: float

    @property
    def is_more_than_noise(self) -> bool:
        """Tell whether the runs show something that the model lacks."""
        return self.misfit > (1 + _SURE * self.error) * self.noise


def leftover(solution: Solution) -> Leftover:
    """Return what a fit leaves, over all samples of all runs."""
    left = np.concatenate([own.ravel() for own in solution.by_run])
    changes = np.concatenate([np.diff(own, axis=0).ravel() for own in solution.by_run])
    count = int(np.isfinite(left).sum())
    return Leftover(
        misfit=root_mean_square(left),
        noise=float(root_mean_square(changes) / np.sqrt(2)),
        error=float(0.5 / np.sqrt(count)),  # of a root: half that of its square
    )
