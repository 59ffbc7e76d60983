"""How well causes explain the misfit, judged in the neighbourhood of a fit.

Every cause may contribute a little unasked: its clutter. What a cause, or a pair of them, is worth
is how far the cost falls when its quantities are released from their clutter while base, own
numbers and all other clutter adapt (a score test, Rao 1948, in the presence of clutter). So a
cause must explain what no mixture of small errors explains, and two causes that look alike are told
apart only as far as the clutter of the others lets them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.layout import Layout
from workbench.diagnose.minimum import CLUTTER, Prior, prior_of, step_from
from workbench.diagnose.problem import Linear

__all__ = ["Neighbourhood", "Score"]

_BLOCK = 60  # samples whose signs turn together: half a second
_DRAWS = 2000
_LEVEL = 99.0  # percent of draws that stay below the threshold
_SEEN = 1e-3  # of the noise: what moves the prediction less moves nothing


@dataclass(frozen=True, eq=False)
class Score:
    """What some causes together are worth.

    Args:
        causes: their names.
        cost: the lowest that is expected with them.
        worth: how far the cost falls when they are released from their clutter.
        size: root mean square of what they explain beyond base and own numbers, in noise
            deviations.
        z: (u,) where the minimum is expected, clutter included.
    """

    causes: tuple[str, ...]
    cost: float
    worth: float
    size: float
    z: NDArray[np.float64]


class Neighbourhood:
    """All causes around one fit.

    Args:
        layout: of the unknowns.
        linear: where the fit ended, with the columns of all causes; those that it released are not
            zero there.
        samples: compared.

    Attributes:
        clutter: (u,) how large each quantity may be unasked.
        silent, heard: causes that the runs say nothing of, and the others.
        little: mean square that the clutter of all causes adds to whitened residuals.
    """

    def __init__(self, layout: Layout, linear: Linear, samples: int) -> None:
        self.layout, self.z, self.linear, self.samples = layout, linear.z, linear, samples
        self.curvature, self.gradient = linear.curvature, linear.gradient
        self._quantities = layout.quantities(tuple(layout.of_cause))
        adapted = self._adapted()
        self._left, white = (adapted.T @ m @ adapted for m in (linear.squares, self.curvature))
        self.clutter = self._clutter()
        self.silent = tuple(name for name in layout.of_cause if self._is_silent(name))
        self.heard = tuple(name for name in layout.of_cause if name not in self.silent)
        self.little = self._expected_clutter(np.diag(white))
        self.cost = sum(float(part @ part) for part in linear.residuals) / 2
        self._nothing = self.lowest(())

    def lowest(self, causes: tuple[str, ...]) -> float:
        """Return the lowest cost that is expected with some causes released."""
        return self._released(causes)[0]

    def score(self, causes: tuple[str, ...]) -> Score:
        """Return what some causes together are worth."""
        cost, z = self._released(causes)
        return Score(causes, cost, self._nothing - cost, self.size(causes, z), z)

    def unexplained(self, causes: tuple[str, ...]) -> list[NDArray[np.float64]]:
        """Return the residuals by run that are expected once all clutter has adapted."""
        move = self._released(causes)[1] - self.z
        pairs = zip(self.linear.residuals, self.linear.jacobians, strict=True)
        return [residual - jacobian @ move for residual, jacobian in pairs]

    def scores(self) -> list[Score]:
        """Return the scores of all causes that these runs excite, best first."""
        return sorted((self.score((name,)) for name in self.heard), key=lambda one: -one.worth)

    def size(self, causes: tuple[str, ...], z: NDArray[np.float64]) -> float:
        """Return how much quantities explain beyond base and own numbers, in noise deviations."""
        own = self.layout.quantities(causes)
        at = np.searchsorted(self._quantities, own)
        return float(np.sqrt(max(z[own] @ self._left[np.ix_(at, at)] @ z[own], 0) / self.samples))

    def spread(self, causes: tuple[str, ...]) -> NDArray[np.float64]:
        """Return the covariance of the released quantities, noise and clutter included."""
        prior = prior_of(self.layout, causes, self.clutter)
        own = np.searchsorted(prior.free, self.layout.quantities(causes))
        inverse = np.linalg.inv(prior.added_to(self.curvature))
        return np.asarray(inverse[np.ix_(own, own)], dtype=np.float64)

    def threshold(self, seed: int = 0) -> float:
        """Return what the best cause is worth in noise alone, once in a hundred times.

        The signs of the residual are turned block by block (wild bootstrap, Wu 1986), for all
        causes at once.
        """
        drawn = self._noise_gradients(seed)
        base = self._forms(prior_of(self.layout, (), self.clutter), drawn)
        greatest = np.zeros(len(drawn))
        for name in self.heard:
            worth = self._forms(prior_of(self.layout, (name,), self.clutter), drawn) - base
            greatest = np.maximum(greatest, worth)
        return float(np.percentile(greatest, _LEVEL))

    def _released(self, causes: tuple[str, ...]) -> tuple[float, NDArray[np.float64]]:
        """Return the lowest cost that is expected with some causes released, and where it is."""
        prior = prior_of(self.layout, causes, self.clutter)
        step = step_from(self.layout, self.z, self.curvature, self.gradient, prior)
        return self.cost + prior.cost(self.z) - step.gain, step.z

    def _adapted(self) -> NDArray[np.float64]:
        """Return one unit of each quantity, base and own numbers adapted to it, (u, q)."""
        prior, asked = prior_of(self.layout), self._quantities
        cross = self.curvature[np.ix_(prior.free, asked)]
        moves = np.zeros((len(self.layout), len(asked)))
        moves[asked, np.arange(len(asked))] = 1.0
        moves[prior.free] = -np.linalg.solve(prior.added_to(self.curvature), cross)
        return moves

    def _clutter(self) -> NDArray[np.float64]:
        """Return how large each quantity may be unasked, (u,) deviations; zero where it is silent.

        That is what contributes `CLUTTER` beyond base and own numbers, and at most its tolerance.
        A number of the base has its tolerance already, so its release has no clutter.
        """
        clutter = np.zeros(len(self.layout))
        released = self.layout.quantities(self.layout.releases)
        for at, i in enumerate(self._quantities):
            left = self._left[at, at]
            if left > self.samples * _SEEN**2 and i not in released:
                clutter[i] = min(CLUTTER * np.sqrt(self.samples / left), 1.0)
        return clutter

    def _expected_clutter(self, white: NDArray[np.float64]) -> float:
        """Return what is expected of all clutter, a mean square; white (q,) is that of one unit."""
        squares = np.zeros(len(self.layout))
        squares[self._quantities] = white * self.clutter[self._quantities] ** 2 / self.samples
        return float(sum(np.mean(squares[self.layout.of_cause[name]]) for name in self.heard))

    def _is_silent(self, name: str) -> bool:
        """Tell whether the runs say nothing about a cause."""
        own = self.layout.of_cause[name]
        if name in self.layout.releases:
            return not np.any(np.diag(self.curvature)[own] > self.samples * _SEEN**2)
        return not self.clutter[own].any()

    def _noise_gradients(self, seed: int) -> NDArray[np.float64]:
        """Return gradients as noise alone makes them, (draws, u)."""
        blocks = []
        for jacobian, left in zip(self.linear.jacobians, self.unexplained(self.heard), strict=True):
            edges = np.arange(0, len(left), 3 * _BLOCK)
            blocks.append(np.add.reduceat(jacobian * left[:, None], edges, axis=0))
        every = np.concatenate(blocks)
        signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(_DRAWS, len(every)))
        return signs @ every

    def _forms(self, prior: Prior, drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return half of g^T (N + P)^-1 g for each drawn gradient."""
        some = drawn[:, prior.free]
        solved = np.linalg.solve(prior.added_to(self.curvature), some.T)
        return np.einsum("ij,ji->i", some, solved) / 2
