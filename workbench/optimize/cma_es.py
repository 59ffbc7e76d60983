"""CMA-ES for few evaluations, through `cmaes`: mirrored samples, projection, restarts.

Hansen, "The CMA evolution strategy: a tutorial", arXiv:1604.00772. Mirrored samples: Brockhoff et
al., "Mirrored sampling and sequential selection for evolution strategies", PPSN 2010. Why each
choice was made is in docs/reference/search.md.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.space import Space

__all__ = ["Cmaes", "CmaesOptions"]

_LEAST_POPULATION = 4
_SEEDS = 2**32  # that `cmaes` takes
_SPENT = 1e-3  # of the bounds' widths: finer than anyone bends


@dataclass(frozen=True)
class CmaesOptions:
    """Options of the search.

    Args:
        population_size: candidates a generation, even: they come in mirrored pairs.
        sigma: the first standard deviation of every variable, of its bounds' width.
        patience: generations without a better candidate until it starts again around the best.
        shrink: the next start's `sigma` over the last one's.
    """

    population_size: int = 8
    sigma: float = 0.2
    patience: int = 15
    shrink: float = 0.5

    def __post_init__(self) -> None:
        """Refuse options that leave no search."""
        if self.population_size < _LEAST_POPULATION or self.population_size % 2:
            raise InputError(
                f"population size {self.population_size} is not even and at least "
                f"{_LEAST_POPULATION}: candidates come in mirrored pairs"
            )
        if not (self.sigma > 0 and self.patience > 0 and 0 < self.shrink <= 1):
            raise InputError(
                f"sigma {self.sigma:g} is above 0, patience {self.patience} at least 1 and "
                f"shrink {self.shrink:g} above 0 and at most 1"
            )


class Cmaes(Algorithm):
    """CMA-ES in coordinates that the bounds' widths scale, with samples in mirrored pairs.

    A sample outside the space is projected into it, and the strategy learns from the projected
    point. Only ranks count; candidates of equal fitness, such as all that fell, rank by their
    distance from the mean, so that the search turns back from where all fail.

    The state holds what was told since the last start, not the inside of `cmaes`: told again in
    order, it leads to the same numbers.

    Args:
        space: what is searched; its start is the first candidate and the first mean.
        seed: of the random generator, which seeds every generation's samples.
        options: those of the default search where not given.
    """

    name = "cma"

    def __init__(self, space: Space, seed: int, options: CmaesOptions | None = None) -> None:
        super().__init__(space, seed)
        self._chosen = options or CmaesOptions()
        self._best, self._least = space.start, np.inf
        self._begin(space.start, self._chosen.sigma)

    @property
    def options(self) -> State:
        """The options and the seed."""
        return {"seed": self.seed} | asdict(self._chosen)

    def ask(self) -> NDArray[np.float64]:
        """Return pairs mirrored at the mean; the first candidate of all is the start itself.

        Returns:
            (n, d) [unit of each variable].
        """
        self._strategy.reseed_rng(int(self.generator.integers(_SEEDS)))
        pairs = self._chosen.population_size // 2
        one = np.array([self._strategy.ask() for _ in range(pairs)])
        drawn = np.stack([one, 2 * self._strategy.mean - one], axis=1).reshape(2 * pairs, -1)
        candidates = self.space.project(self.space.lower + self.space.widths * drawn)
        if np.isinf(self._least):
            candidates[0] = self.space.start
        return candidates

    def tell(self, candidates: NDArray[np.float64], fitness: NDArray[np.float64]) -> None:
        """Learn from a generation; start again where it has stalled."""
        self._learn(candidates, fitness)
        if fitness.min() < self._least:
            self._best, self._least = candidates[np.argmin(fitness)].copy(), float(fitness.min())
            self._stalled = 0
        else:
            self._stalled += 1
        if self._stalled >= self._chosen.patience or self._strategy.should_stop():
            self._begin(self._best, self._sigma * self._chosen.shrink)

    def state(self) -> State:
        """Return the generator, the best, and where and with what the strategy began and learnt."""
        return {
            "generator": self._generator_state(),
            "best": self._best.tolist(),
            "least": None if np.isinf(self._least) else self._least,
            "stalled": self._stalled,
            "begun_at": self._begun_at.tolist(),
            "sigma": self._sigma,
            "told": [[c.tolist(), f.tolist()] for c, f in self._told],
        }

    def restore(self, state: State) -> None:
        """Take up what `state` gave, telling the strategy again what it was told."""
        self._begin(np.array(state["begun_at"], dtype=np.float64), float(state["sigma"]))
        for candidates, fitness in state["told"]:
            self._learn(np.array(candidates, dtype=np.float64), np.array(fitness, dtype=np.float64))
        self._best = np.array(state["best"], dtype=np.float64)
        self._least = np.inf if state["least"] is None else float(state["least"])
        self._stalled = int(state["stalled"])
        self._restore_generator(state["generator"])

    def _begin(self, mean: NDArray[np.float64], sigma: float) -> None:
        from cmaes import CMA  # with scipy's statistics

        self._begun_at, self._sigma, self._stalled = mean, max(sigma, _SPENT), 0
        self._told: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        size = self._chosen.population_size
        self._strategy = CMA(self._scaled(mean), self._sigma, population_size=size)

    def _learn(self, candidates: NDArray[np.float64], fitness: NDArray[np.float64]) -> None:
        self._told.append((candidates.copy(), fitness.copy()))
        scaled = self._scaled(candidates)
        distance = np.linalg.norm(scaled - self._strategy.mean, axis=1)
        order = np.lexsort((distance, fitness))
        self._strategy.tell([(scaled[row], float(rank)) for rank, row in enumerate(order)])

    def _scaled(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return (points - self.space.lower) / self.space.widths
