"""A hypothesis as fitted: the base with some candidates released, and what each second costs it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.fit import ROBUST, Estimator, Innovations, Linear, counted, edges_of, soft

__all__ = ["Hypothesis", "blocks_of", "by_cost", "noise_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The base with some candidates released, as fitted.

    Args:
        names: of the candidates; none is the base.
        estimator: of the fitted runs, with its process noise.
        x: (p,) numbers of its parameters [prior deviations].
        blocks: (b,) of each fitted run, -2 ln L of each second [1].
        prior: -2 ln of the priors of its numbers.
        jacobian: (m, p) of the residuals at the end of the fit, or near it [1].
    """

    names: tuple[str, ...]
    estimator: Estimator
    x: Array
    blocks: tuple[Array, ...]
    prior: float
    jacobian: Array

    @property
    def cost(self) -> float:
        """Return -2 ln of the posterior of the fitted runs."""
        return self.prior + sum(float(one.sum()) for one in self.blocks)

    @property
    def values(self) -> dict[str, float]:
        """Return the value of each parameter by its name."""
        vector = self.estimator.vector
        return {one.name: value for one, value in vector.values(self.x).items()}

    @cached_property
    def deviations(self) -> dict[str, float]:
        """Return the standard error of each parameter by its name, where it is fitted to its end.

        It counts the scatter from second to second, and what a fit that ended at a kink of the cost
        would still move.
        """
        estimator, vector = self.estimator, self.estimator.vector
        near = Linear.around(estimator, self.x, estimator.residuals(self.x), self.jacobian)
        solved = near.solved({p.name: not p.released for p in vector.parameters})
        spread = np.hypot(solved.deviation, solved.x - self.x)
        return {
            p.name: abs(p.value(float(x + d)) - p.value(float(x - d))) / 2
            for p, x, d in zip(vector.parameters, self.x, spread, strict=True)
        }


def by_cost(one: Hypothesis) -> float:
    """Return what the likelier of two hypotheses has less of."""
    return one.cost


def noise_of(ones: Iterable[Hypothesis]) -> dict[str, float]:
    """Return the process noise of hypotheses, each of other runs, by group of joints.

    Args:
        ones: of a group that acts in several the last counts.
    """
    noise = dict[str, float]()
    for one in ones:
        every = one.estimator.noise.items()
        noise |= {g: q for g, q in every if g not in noise or one.estimator.depends_on(g)}
    return noise


def blocks_of(one: Innovations, sample_s: float) -> Array:
    """Return -2 ln L of each second of a run, (b,) [1].

    Args:
        one: what the observer found.
        sample_s: from one sample to the next.
    """
    costs = soft(counted(one), ROBUST).sum(axis=1) + one.information
    edges = edges_of(len(costs), sample_s)
    return np.array([float(costs[a:b].sum()) for a, b in pairwise(edges)])
