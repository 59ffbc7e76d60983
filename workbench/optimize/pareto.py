"""Two goals or more at once: the front that none of its points is beaten in all goals.

NSGA-II through `pymoo`, the extra `pareto`; nothing else imports it. Deb et al., "A fast and
elitist multiobjective genetic algorithm: NSGA-II", IEEE Trans. Evol. Comput. 6 (2002) 182.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.space import Space

if TYPE_CHECKING:
    from pymoo.algorithms.moo.nsga2 import NSGA2

__all__ = ["Pareto", "ParetoOptions"]


@dataclass(frozen=True)
class ParetoOptions:
    """Options of the search.

    Args:
        population_size: candidates a generation.
        spread: standard deviation of the first generation about the start, of the bounds' widths.
    """

    population_size: int = 24
    spread: float = 0.1

    def __post_init__(self) -> None:
        """Refuse options that leave no search."""
        if self.population_size < 2 or not self.spread > 0:
            raise InputError(
                f"population size {self.population_size} is at least 2 and spread {self.spread:g} "
                "above 0"
            )


class Pareto(Algorithm):
    """NSGA-II with pymoo's operators; every candidate is projected into the space.

    The state is what was told: asked and told again in order, it leads to the same numbers.

    Args:
        space: what is searched; its start is the first candidate.
        seed: of the random generator.
        goals: how many numbers a fitness has.
        options: see there.

    Raises:
        InputError: when `pymoo` is not installed.
    """

    name = "nsga2"

    def __init__(
        self, space: Space, seed: int, goals: int = 2, options: ParetoOptions | None = None
    ) -> None:
        super().__init__(space, seed)
        self.goals = goals
        self._chosen = options or ParetoOptions()
        self._begin()

    @property
    def options(self) -> State:
        """The options, the number of goals and the seed."""
        return {"seed": self.seed, "goals": self.goals} | asdict(self._chosen)

    def ask(self) -> NDArray[np.float64]:
        """Return the start and its neighbourhood, then the children of the last survivors.

        There can be fewer than the population's size: two equal candidates are never asked for.

        Returns:
            (n, d) [unit of each variable].
        """
        self._asked = self._search.ask()
        return np.zeros((0, len(self.space))) if self._asked is None else self._asked.get("X")

    def tell(self, candidates: NDArray[np.float64], fitness: NDArray[np.float64]) -> None:
        """Let the best of parents and children survive."""
        if self._asked is None:
            raise InputError("a generation is told before it was asked for")
        self._asked.set("F", fitness)
        self._search.tell(infills=self._asked)
        self._told.append((candidates.copy(), fitness.copy()))

    def state(self) -> State:
        """Return the generator and everything that was told."""
        return {
            "generator": self._generator_state(),
            "told": [[candidates.tolist(), fitness.tolist()] for candidates, fitness in self._told],
        }

    def restore(self, state: State) -> None:
        """Ask and tell again what the state holds.

        Raises:
            InputError: when this software would have asked for something else.
        """
        self.generator = np.random.default_rng(self.seed)
        self._begin()
        for candidates, fitness in state["told"]:
            same = np.array_equal(self.ask(), np.array(candidates))
            if not same:
                raise InputError(
                    "this version of pymoo or numpy searches otherwise than the one that wrote the "
                    "checkpoint; install that one or search anew"
                )
            self.tell(np.array(candidates), np.array(fitness))

    def _begin(self) -> None:
        first = np.repeat(self.space.start[None], self._chosen.population_size, axis=0)
        first[1:] += (
            self._chosen.spread
            * self.space.widths
            * self.generator.standard_normal(first[1:].shape)
        )
        self._search = _nsga2(self.space, self.goals, self.space.project(first))
        self._search.random_state = self.generator
        self._asked: Any = None  # a Population of pymoo
        self._told: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []


def _nsga2(space: Space, goals: int, first: NDArray[np.float64]) -> NSGA2:
    _require_pymoo()
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.core.repair import Repair
    from pymoo.core.termination import NoTermination

    class Projection(Repair):
        def _do(self, problem: Problem, X: NDArray[np.float64], **_: object) -> NDArray[np.float64]:  # noqa: N803
            return space.project(X)

    problem = Problem(n_var=len(space), n_obj=goals, xl=space.lower, xu=space.upper)
    search = NSGA2(pop_size=len(first), sampling=first, repair=Projection())  # pyright: ignore[reportArgumentType]
    search.setup(problem, termination=NoTermination())
    return search


def _require_pymoo() -> None:
    try:
        import pymoo  # noqa: F401
    except ModuleNotFoundError:
        raise InputError(
            "a Pareto front needs the package pymoo; pip install hopping-workbench[pareto]"
        ) from None
