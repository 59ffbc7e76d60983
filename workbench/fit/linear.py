"""What every candidate would gain where residuals are straight: one Jacobian for the whole library.

With residuals r and their Jacobian J around numbers x of unit prior deviation, and robust weights
W, the least cost where some numbers move is that of a linear regression,

    (J' W J + P) dx = -(J' W r + P x),   P the priors: 1, of a released number 2 / (1 + x^2).

That is Cauchy's prior, with x where the number ends: found in a few rounds, that begin where the
residuals alone would have it, for what is far off may well be there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.fit.estimator import ROBUST, Estimator
from workbench.fit.minimise import soft, weights
from workbench.fit.parameters import Known, ParameterVector, beyond

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
        known: of some numbers, what takes the place of their own priors; None where nothing is.
    """

    names: tuple[str, ...]
    own: NDArray[np.bool_]
    x: Array
    residuals: Array
    jacobian: Array
    edges: NDArray[np.int64]
    known: Known | None = None

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
        return cls(
            names, vector.own, x, residuals[:count], jacobian[:count], np.array(edges),
            vector.known,
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

    @cached_property
    def _normal(self) -> tuple[Array, Array]:
        """Return centre (p,) and precision (p, p) [1] of the priors, were all normal."""
        centre, precision = np.zeros(len(self.names)), np.eye(len(self.names))
        if self.known is not None:
            at = [self.names.index(name) for name in self.known.names]
            centre[at], precision[np.ix_(at, at)] = self.known.at, self.known.precision
        return centre, precision

    def _normally(self, x: Array, chosen: NDArray[np.intp]) -> float:
        """Return what normal priors of some numbers (p,) cost."""
        off, precision = (x - self._normal[0])[chosen], self._normal[1][np.ix_(chosen, chosen)]
        return float(off @ precision @ off)

    def fall(self, moving: Mapping[str, bool]) -> float:
        """Return by how much the cost falls where some numbers move; cheap, without blocks.

        Args:
            moving: name -> whether its prior is normal; Cauchy's if not.
        """
        one = self._solution(moving)
        chosen, steps = one.chosen, (one.x - self.x)[one.chosen]
        curvature, slope = self.curvature[np.ix_(chosen, chosen)], self.slope[chosen]
        fitted = float(-2 * slope @ steps - steps @ curvature @ steps)
        normal, released = chosen[one.normal], chosen[~one.normal]
        before = self._normally(self.x, normal) + float(np.sum(self.x[released] ** 2))
        after = self._normally(one.x, normal) + float(np.sum(beyond(one.x[released])))
        return fitted + before - after

    def _solution(self, moving: Mapping[str, bool]) -> _Solution:
        """Return where the numbers that move go."""
        every = enumerate(zip(self.names, self.own, strict=True))
        chosen = np.array(
            [i for i, (name, own) in every if own or name in moving],
            dtype=np.intp,  # where nothing moves, too: no run held out is driven
        )
        normal = np.array([moving.get(self.names[i], True) for i in chosen], dtype=np.bool_)
        before, curvature = self.x[chosen], self.curvature[np.ix_(chosen, chosen)]
        centre, precision = self._normal
        both = np.outer(normal, normal)
        whole = np.where(both, precision[np.ix_(chosen, chosen)], 0.0)
        pull = (precision @ (self.x - centre))[chosen]

        def of(released: Array) -> tuple[Array, Array]:
            """Return the priors' curvature and the gradient, by the curvature of released ones."""
            prior = whole + np.diag(np.where(normal, 0.0, released))
            return prior, self.slope[chosen] + np.where(normal, pull, released * before)

        released, last = np.full(len(chosen), _FREED), before
        for _ in range(0 if normal.all() else _PRIOR_ROUNDS):
            prior, gradient = of(released)
            moved = before - _solved(curvature + prior, gradient)
            released = 2 / (1 + moved**2)
            if np.abs(moved - last).max() < _SETTLED:
                break
            last = moved
        prior, gradient = of(released)
        inverse = np.asarray(np.linalg.pinv(curvature + prior, hermitian=True), dtype=np.float64)
        x = self.x.copy()
        x[chosen] -= inverse @ gradient
        return _Solution(chosen, normal, x, prior, inverse)

    def wider(self, moving: Mapping[str, bool], others: Iterable[str]) -> dict[str, float]:
        """Return by what factor the error of each number grows where others may be off as well.

        Args:
            moving: as `solved` has it.
            others: names of numbers that may be off as their normal priors have it.
        """
        alone = self._spread(moving)
        beside = self._spread({**dict.fromkeys(others, True), **moving})
        pairs = zip(self.names, alone, beside, strict=True)
        return {name: max(float(b / a), 1.0) if a > 0 else 1.0 for name, a, b in pairs}

    def _spread(self, moving: Mapping[str, bool]) -> Array:
        """Return the errors of numbers, (p,), were residuals white; zero where held."""
        one, spread = self._solution(moving), np.zeros(len(self.x))
        spread[one.chosen] = np.sqrt(np.diag(one.inverse))
        return spread

    def solved(self, moving: Mapping[str, bool]) -> Solved:
        """Return the least cost where numbers by name move -> whether their prior is normal."""
        one = self._solution(moving)
        chosen, inverse = one.chosen, one.inverse
        slopes = self.jacobian[:, chosen]
        left = self.residuals + slopes @ (one.x - self.x)[chosen]
        blocks = np.add.reduceat(soft(left, ROBUST), self.edges[:-1])
        scores = np.array(
            [slopes[a:b].T @ (self.weights[a:b] * left[a:b]) for a, b in pairwise(self.edges)]
        )
        spread = inverse @ (scores.T @ scores + one.prior) @ inverse
        deviation = np.zeros(len(self.x))
        deviation[chosen] = np.sqrt(np.maximum(np.diag(spread), np.diag(inverse)))
        cost = float(blocks.sum()) + self._normally(one.x, chosen[one.normal])
        return Solved(one.x, deviation, blocks, cost)


class _Solution(NamedTuple):
    """Where numbers that move go.

    Args:
        chosen: (k,) those that move.
        normal: (k,) whether their priors are normal.
        x: (p,) all, there [prior deviations].
        prior: (k, k) curvature of the priors [1].
        inverse: (k, k) of the whole curvature [1].
    """

    chosen: NDArray[np.intp]
    normal: NDArray[np.bool_]
    x: Array
    prior: Array
    inverse: Array


def _solved(curvature: Array, gradient: Array) -> Array:
    """Return a whole step, (p,); the shortest where rounding leaves a direction no curvature."""
    try:
        return np.asarray(np.linalg.solve(curvature, gradient), dtype=np.float64)
    except np.linalg.LinAlgError:  # two numbers do exactly the same, and a prior is lost beside it
        return np.asarray(np.linalg.pinv(curvature, hermitian=True) @ gradient, dtype=np.float64)
