"""The genetic algorithm of the thesis: MATLAB's `ga` with the operators that it names.

What MATLAB documents of each operator and what is our reading is in
docs/reference/search.md.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.space import Space

__all__ = ["GeneticAlgorithm", "GeneticOptions", "expectation", "roulette", "scattered"]

_EXPAND, _CONTRACT = 2.0, 0.5  # of the adaptive step, as in MATLAB's pattern search
_LEAST_STEP = 1e-3  # of the bounds' widths: 0.6 mrad of an angle, finer than anyone bends


@dataclass(frozen=True)
class GeneticOptions:
    """Options of `ga`, named as in MATLAB but in lower case with underscores.

    Args:
        population_size: `PopulationSize`.
        generations: `Generations`; only Gaussian mutation, which shrinks until then, needs it.
        elite_count: `EliteCount`, how many of the best live on unchanged.
        crossover_fraction: `CrossoverFraction`, of the children that are not elite.
        max_survival_rate: of `fitscalingshiftlinear`.
        mutation_fcn: `MutationFcn`.
        scale: of `mutationgaussian`: the first generation's standard deviation, of the bounds'
            widths.
        shrink: of `mutationgaussian`: by what part the deviation falls until the last generation.
        creation_fcn: the initial population beside the start: `variation` mutates the start, as the
            thesis says; `gacreationlinearfeasible` draws from the whole space.
    """

    population_size: int = 12
    generations: int = 40
    elite_count: int = 1
    crossover_fraction: float = 0.5
    max_survival_rate: float = 2.0
    mutation_fcn: Literal["mutationadaptfeasible", "mutationgaussian"] = "mutationadaptfeasible"
    scale: float = 1.0
    shrink: float = 1.0
    creation_fcn: Literal["variation", "gacreationlinearfeasible"] = "variation"

    def __post_init__(self) -> None:
        """Refuse options that leave no search."""
        if not 0 <= self.elite_count < self.population_size:
            raise InputError(
                f"elite count {self.elite_count} leaves no children in a population of "
                f"{self.population_size}; it is 0 or more and less than that"
            )
        if not 0 <= self.crossover_fraction <= 1:
            raise InputError(f"crossover fraction {self.crossover_fraction:g} is not 0 to 1")
        if not self.max_survival_rate > 1:
            raise InputError(f"max survival rate {self.max_survival_rate:g} is not above 1")
        if not (self.scale > 0 and 0 <= self.shrink <= 1 and self.generations > 0):
            raise InputError(
                f"scale {self.scale:g} is above 0, shrink {self.shrink:g} is 0 to 1 and "
                f"generations {self.generations} at least 1"
            )


class GeneticAlgorithm(Algorithm):
    """MATLAB's `ga` with shift-linear scaling, roulette and scattered crossover.

    A generation is elite, crossover children and mutation children, in this order; each child is
    projected into the space, so that bounds and sum hold for every individual.

    Args:
        space: what is searched; its start is the first individual.
        seed: of the random generator.
        options: those of the thesis where not given.
    """

    name = "ga"

    def __init__(self, space: Space, seed: int, options: GeneticOptions | None = None) -> None:
        super().__init__(space, seed)
        self._chosen = options or GeneticOptions()
        self._population = np.empty((0, len(space)))
        self._fitness = np.empty(0)
        self._generation = 0
        self._step = 1.0

    @property
    def options(self) -> State:
        """The options and the seed."""
        return {"seed": self.seed} | asdict(self._chosen)

    def ask(self) -> NDArray[np.float64]:
        """Return the initial population, then the children of the one told last.

        Returns:
            (n, d) [unit of each variable].
        """
        if not self._generation:
            return self._create()
        chosen = self._chosen
        children = chosen.population_size - chosen.elite_count
        crossed = int(np.floor(chosen.crossover_fraction * children + 0.5))
        expected = expectation(self._fitness, chosen.max_survival_rate)
        parents = self._population[roulette(self.generator, expected, crossed + children)]
        elite = np.argsort(self._fitness, kind="stable")[: chosen.elite_count]
        first, second, single = np.split(parents, [crossed, 2 * crossed])
        bred = np.vstack([scattered(self.generator, first, second), self._mutate(single)])
        return np.vstack([self._population[elite], self.space.project(bred)])

    def tell(self, candidates: NDArray[np.float64], fitness: NDArray[np.float64]) -> None:
        """Make the candidates the population and adapt the step to their success."""
        if self._generation:
            better = fitness.min() < self._fitness.min()
            factor = _EXPAND if better else _CONTRACT
            self._step = float(np.clip(self._step * factor, _LEAST_STEP, 1.0))
        self._population, self._fitness = candidates.copy(), fitness.copy()
        self._generation += 1

    def state(self) -> State:
        """Return generator, population, its fitness, and how far mutation has come."""
        return {
            "generator": self._generator_state(),
            "population": self._population.tolist(),
            "fitness": self._fitness.tolist(),
            "generation": self._generation,
            "step": self._step,
        }

    def restore(self, state: State) -> None:
        """Take up what `state` gave."""
        self._restore_generator(state["generator"])
        self._population = np.array(state["population"], dtype=np.float64)
        self._fitness = np.array(state["fitness"], dtype=np.float64)
        self._generation = int(state["generation"])
        self._step = float(state["step"])

    def _create(self) -> NDArray[np.float64]:
        others = self._chosen.population_size - 1
        start = self.space.start[None]
        if self._chosen.creation_fcn == "variation":
            drawn = self.space.project(self._mutate(np.repeat(start, others, axis=0)))
        else:
            drawn = self.space.sample(self.generator, others)
        return np.vstack([start, drawn])

    def _mutate(self, parents: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return one mutated child for each parent, perhaps outside the space."""
        drawn = self.generator.standard_normal(parents.shape)
        if self._chosen.mutation_fcn == "mutationgaussian":
            remaining = 1 - self._chosen.shrink * min(
                1.0, self._generation / self._chosen.generations
            )
            return parents + self._chosen.scale * remaining * self.space.widths * drawn
        directions = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
        return parents + self._step * self.space.widths * directions


def expectation(fitness: NDArray[np.float64], max_survival_rate: float) -> NDArray[np.float64]:
    """Return how many parents' places each individual is due, shift-linear, (n,) [1] of mean 1.

    The values are a linear function of the fitness: the best is due `max_survival_rate`, the
    mean 1. Where the worst would be due less than nothing it is due nothing, and the best less.

    Args:
        fitness: (n,) less is better [unit of the goal].
        max_survival_rate: what the best is due.
    """
    best, worst = fitness.min(), fitness.max()
    if best == worst:
        return np.ones(len(fitness))
    score = (worst - fitness) / (worst - best)  # 1 is the best, 0 the worst
    mean = score.mean()
    slope = min((max_survival_rate - 1) / (1 - mean), 1 / mean)
    return np.maximum(1 + slope * (score - mean), 0.0)


def roulette(
    generator: np.random.Generator, expected: NDArray[np.float64], count: int
) -> NDArray[np.intp]:
    """Draw individuals, (count,), each with a chance proportional to its expectation.

    Args:
        generator: of all that is random.
        expected: (n,) of `expectation` [1].
        count: how many are drawn.
    """
    return generator.choice(len(expected), size=count, p=expected / expected.sum())


def scattered(
    generator: np.random.Generator, first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return children, (n, d) [unit of each variable], of two parents by the toss of coins.

    Args:
        generator: of all that is random.
        first: (n, d) parents [unit of each variable].
        second: (n, d) the others [unit of each variable].
    """
    return np.where(generator.integers(0, 2, first.shape, dtype=bool), first, second)
