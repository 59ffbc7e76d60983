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
from workbench.diagnose.problem import Linear
from workbench.diagnose.solve import CLUTTER, Prior, Step, prior_of, step_from

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
        worth: how far the cost falls when they are released from their clutter.
        size: root mean square of what they explain beyond base and own numbers, in noise
            deviations.
        z: (u,) where the minimum is expected, clutter included.
    """

    causes: tuple[str, ...]
    worth: float
    size: float
    z: NDArray[np.float64]


class Neighbourhood:
    """All causes around one fit.

    Args:
        layout: of the unknowns.
        z: (u,) of the fit; causes that it released are not zero there.
        linear: with the columns of all causes.
        samples: compared.
    """

    def __init__(
        self, layout: Layout, z: NDArray[np.float64], linear: Linear, samples: int
    ) -> None:
        self.layout, self.z, self.linear, self.samples = layout, z, linear, samples
        self.curvature, self.gradient = linear.curvatures.sum(0), linear.gradients.sum(0)
        self._left = self._beyond_base()
        self.clutter = self._clutter()
        self.silent = tuple(name for name in layout.of_cause if self._is_silent(name))
        self.heard = tuple(name for name in layout.of_cause if name not in self.silent)
        self.cost = sum(float(part @ part) for part in linear.residuals) / 2
        self._nothing = self.lowest(())

    def lowest(self, causes: tuple[str, ...]) -> float:
        """Return the lowest cost that is expected with some causes released."""
        prior = prior_of(self.layout, causes, self.clutter)
        step = self._step(prior)
        here = float(prior.precision[prior.free] @ self.z[prior.free] ** 2) / 2
        return self.cost + here - step.gain

    def score(self, causes: tuple[str, ...]) -> Score:
        """Return what some causes together are worth."""
        prior = prior_of(self.layout, causes, self.clutter)
        step = self._step(prior)
        here = float(prior.precision[prior.free] @ self.z[prior.free] ** 2) / 2
        worth = self._nothing - (self.cost + here - step.gain)
        return Score(causes, worth, self.size(causes, step.z), step.z)

    def unexplained(self, causes: tuple[str, ...]) -> list[NDArray[np.float64]]:
        """Return the residuals by run that are expected once all clutter has adapted."""
        move = self._step(prior_of(self.layout, causes, self.clutter)).z - self.z
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
        free = prior.free
        matrix = self.curvature[np.ix_(free, free)] + np.diag(prior.precision[free])
        own = np.searchsorted(free, self.layout.quantities(causes))
        return np.linalg.inv(matrix)[np.ix_(own, own)]

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

    def left_out(self, causes: tuple[str, ...]) -> NDArray[np.float64]:
        """Return how much better each run is foretold by a fit of all others, (r,) of the cost.

        Own numbers of the run left out adapt to it; what is shared does not.
        """
        return self._foretold(()) - self._foretold(causes)

    def _foretold(self, causes: tuple[str, ...]) -> NDArray[np.float64]:
        layout, linear = self.layout, self.linear
        prior = prior_of(layout, causes, self.clutter)
        costs = []
        for row, run in enumerate(linear.runs):
            curvature = self.curvature - linear.curvatures[row]
            gradient = self.gradient - linear.gradients[row]
            there = step_from(layout, self.z, curvature, gradient, prior).z
            own = Prior(prior.precision, layout.own(run))
            there[own.free] = self.z[own.free]
            left = linear.residuals[row] - linear.jacobians[row] @ (there - self.z)
            step = step_from(
                layout, there, linear.curvatures[row], linear.jacobians[row].T @ left, own
            )
            costs.append(float(left @ left) / 2 - step.gain)
        return np.array(costs)

    def _step(self, prior: Prior) -> Step:
        return step_from(self.layout, self.z, self.curvature, self.gradient, prior)

    def _beyond_base(self) -> NDArray[np.float64]:
        """Return the curvature of all quantities after base and own numbers adapted."""
        prior = prior_of(self.layout)
        free, total = prior.free, self.curvature
        self._quantities = self.layout.quantities(tuple(self.layout.of_cause))
        inner = total[np.ix_(free, free)] + np.diag(prior.precision[free])
        cross = total[np.ix_(free, self._quantities)]
        left = total[np.ix_(self._quantities, self._quantities)]
        return left - cross.T @ np.linalg.solve(inner, cross)

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

    def _is_silent(self, name: str) -> bool:
        """Tell whether the runs say nothing about a cause."""
        own = self.layout.of_cause[name]
        if name in self.layout.releases:
            return not np.any(np.diag(self.curvature)[own] > self.samples * _SEEN**2)
        return not self.clutter[own].any()

    def _noise_gradients(self, seed: int) -> NDArray[np.float64]:
        """Return gradients as noise alone makes them, (draws, u)."""
        most = self._step(prior_of(self.layout, self.heard, self.clutter)).z - self.z
        blocks = []
        for jacobian, residual in zip(self.linear.jacobians, self.linear.residuals, strict=True):
            left = residual - jacobian @ most
            edges = np.arange(0, len(left), 3 * _BLOCK)
            blocks.append(np.add.reduceat(jacobian * left[:, None], edges, axis=0))
        every = np.concatenate(blocks)
        signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(_DRAWS, len(every)))
        return signs @ every

    def _forms(self, prior: Prior, drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return half of g^T (N + P)^-1 g for each drawn gradient."""
        free = prior.free
        matrix = self.curvature[np.ix_(free, free)] + np.diag(prior.precision[free])
        some = drawn[:, free]
        return np.einsum("ij,ij->i", some, np.linalg.solve(matrix, some.T).T) / 2
