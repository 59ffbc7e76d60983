"""What every candidate would gain where residuals are straight: one Jacobian for the whole library.

With residuals r and their Jacobian J around numbers x of unit prior deviation, and robust weights
W, the least cost where some numbers move is that of a linear regression,

    (J' W J + P) dx = -(J' W r + P x),   P the priors: 1, of a released number 2 / (1 + x^2).

That is Cauchy's prior, with x where the number ends: found in a few rounds, that begin where the
residuals alone would have it, for what is far off may well be there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.fit.estimator import ROBUST, Estimator
from workbench.fit.minimise import soft, weights
from workbench.fit.parameters import ParameterVector, beyond

__all__ = ["Linear", "Solved", "edges_of", "eliminated"]

Array = NDArray[np.float64]

_BLOCK_S = 1.0
_FEWEST = 4  # blocks of a run
_FREED = 1e-4  # of the curvature of a prior, where released numbers begin
_PRIOR_ROUNDS, _SETTLED = 10, 0.05  # until no number moves by more [prior deviations]


def eliminated(curvature: Array, others: NDArray[np.bool_]) -> Array:
    """Return a curvature (p, p) [1] of some numbers where the others go to their best.

    Args:
        curvature: (q, q) of all [1].
        others: (q,) which go to their best.
    """
    own, mixed = curvature[np.ix_(others, others)], curvature[np.ix_(others, ~others)]
    return curvature[np.ix_(~others, ~others)] - mixed.T @ np.linalg.pinv(own) @ mixed


def edges_of(count: int, sample_s: float) -> NDArray[np.int64]:
    """Return the edges of a run's blocks of about a second, (b + 1,), in samples."""
    pieces = max(_FEWEST, round(count * sample_s / _BLOCK_S))
    return np.linspace(0, count, pieces + 1).round().astype(np.int64)


@dataclass(frozen=True, eq=False)
class Solved:
    """The least cost where some numbers move.

    Args:
        x: (p,) numbers there [prior deviations].
        deviation: (p,) their standard errors, scatter from block to block counted [prior
            deviations]; zero where held.
        blocks: (b,) cost of each block [1].
        cost: of all, normal priors included. What is released is to be seen before it pays.
    """

    x: Array
    deviation: Array
    blocks: Array
    cost: float


@dataclass(frozen=True, eq=False)
class Linear:
    """Residuals and derivatives of everything around a fit.

    Args:
        names: of the numbers.
        own: (p,) which belong to single runs; they always move.
        x: (p,) numbers [prior deviations].
        residuals: (m,) there [1].
        jacobian: (m, p) derivatives of the residuals by the numbers [1].
        edges: (b + 1,) of the blocks, in residuals.
    """

    names: tuple[str, ...]
    own: NDArray[np.bool_]
    x: Array
    residuals: Array
    jacobian: Array
    edges: NDArray[np.int64]

    @classmethod
    def around(cls, estimator: Estimator, x: Array, residuals: Array, jacobian: Array) -> Linear:
        """Return what is known around numbers of an estimator, without the priors' rows.

        Args:
            estimator: of the runs.
            x: (p,) numbers [prior deviations].
            residuals: (m,) there [1].
            jacobian: (m, p) of them [1].
        """
        vector, system, edges = estimator.vector, estimator.system, [0]
        for seen in map(system.seen, range(len(system.names))):
            edges += list(edges[-1] + seen.shape[1] * edges_of(len(seen), system.sample_s)[1:])
        names, count = tuple(p.name for p in vector.parameters), edges[-1]
        return cls(names, vector.own, x, residuals[:count], jacobian[:count], np.array(edges))

    def of_runs(self, estimator: Estimator, runs: Sequence[int]) -> Linear:
        """Return the same of some runs alone.

        Args:
            estimator: of all runs.
            runs: their numbers.
        """
        rows, edges = list[NDArray[np.intp]](), [0]
        for first, end in (estimator.edges[k : k + 2] for k in runs):
            inside = self.edges[(self.edges > first) & (self.edges <= end)]
            edges += list(edges[-1] + inside - first)
            rows.append(np.arange(first, end))
        kept = np.concatenate(rows)
        return replace(
            self, residuals=self.residuals[kept], jacobian=self.jacobian[kept],
            edges=np.array(edges),
        )  # fmt: skip

    def columns(self, vector: ParameterVector, x: Array) -> Array:
        """Return the derivatives by some parameters, with the rows of their priors, (m, p) [1].

        Args:
            vector: of the parameters.
            x: (p,) the minimiser's numbers that the priors' rows are taken at [1].
        """
        at = {name: k for k, name in enumerate(self.names)}
        own = self.jacobian[:, [at[p.name] for p in vector.parameters]]
        return np.vstack([own, vector.prior_slopes(x)])

    @cached_property
    def weights(self) -> Array:
        """Return the robust weights of the residuals, (m,) [1]."""
        return weights(self.residuals, ROBUST)

    @cached_property
    def curvature(self) -> Array:
        """Return J' W J, (p, p) [1]."""
        return np.asarray(self.jacobian.T @ (self.jacobian * self.weights[:, None]))

    @cached_property
    def slope(self) -> Array:
        """Return J' W r, (p,) [1]."""
        return np.asarray(self.jacobian.T @ (self.weights * self.residuals), dtype=np.float64)

    def fall(self, moving: Mapping[str, bool]) -> float:
        """Return by how much the cost falls where some numbers move; cheap, without blocks.

        Args:
            moving: name -> whether its prior is normal; Cauchy's if not.
        """
        chosen, normal, _, inverse, gradient = self._solution(moving)
        before, steps = self.x[chosen], -inverse @ gradient
        curvature, slope = self.curvature[np.ix_(chosen, chosen)], self.slope[chosen]
        fitted = float(-2 * slope @ steps - steps @ curvature @ steps)
        after = before + steps
        priors = np.sum(before**2) - np.sum(after[normal] ** 2) - np.sum(beyond(after[~normal]))
        return fitted + float(priors)

    def _solution(
        self, moving: Mapping[str, bool]
    ) -> tuple[NDArray[np.intp], NDArray[np.bool_], Array, Array, Array]:
        """Return what moves, which are normal, priors, inverse of the curvature, and gradient."""
        chosen = np.array(
            [
                i
                for i, (name, own) in enumerate(zip(self.names, self.own, strict=True))
                if own or name in moving
            ],
            dtype=np.intp,  # where nothing moves, too: no run held out is driven
        )
        normal = np.array([moving.get(self.names[i], True) for i in chosen], dtype=np.bool_)
        before, curvature = self.x[chosen], self.curvature[np.ix_(chosen, chosen)]
        prior, last = np.where(normal, 1.0, _FREED), before
        for _ in range(0 if normal.all() else _PRIOR_ROUNDS):
            gradient = self.slope[chosen] + prior * before
            moved = before - _solved(curvature + np.diag(prior), gradient)
            prior = np.where(normal, 1.0, 2 / (1 + moved**2))
            if np.abs(moved - last).max() < _SETTLED:
                break
            last = moved
        gradient = self.slope[chosen] + prior * before
        inverse = np.linalg.pinv(curvature + np.diag(prior), hermitian=True)
        return chosen, normal, prior, np.asarray(inverse, dtype=np.float64), gradient

    def solved(self, moving: Mapping[str, bool]) -> Solved:
        """Return the least cost where numbers by name move -> whether their prior is normal."""
        chosen, normal, prior, inverse, gradient = self._solution(moving)
        slopes = self.jacobian[:, chosen]
        moved = self.x.copy()
        moved[chosen] -= inverse @ gradient
        left = self.residuals + slopes @ (moved - self.x)[chosen]
        blocks = np.add.reduceat(soft(left, ROBUST), self.edges[:-1])
        scores = np.array(
            [slopes[a:b].T @ (self.weights[a:b] * left[a:b]) for a, b in pairwise(self.edges)]
        )
        spread = inverse @ (scores.T @ scores + np.diag(prior)) @ inverse
        deviation = np.zeros(len(self.x))
        deviation[chosen] = np.sqrt(np.maximum(np.diag(spread), np.diag(inverse)))
        cost = float(blocks.sum() + np.sum(moved[chosen][normal] ** 2))
        return Solved(moved, deviation, blocks, cost)


def _solved(curvature: Array, gradient: Array) -> Array:
    """Return a whole step, (p,); the shortest where rounding leaves a direction no curvature."""
    try:
        return np.asarray(np.linalg.solve(curvature, gradient), dtype=np.float64)
    except np.linalg.LinAlgError:  # two numbers do exactly the same, and a prior is lost beside it
        return np.asarray(np.linalg.pinv(curvature, hermitian=True) @ gradient, dtype=np.float64)
