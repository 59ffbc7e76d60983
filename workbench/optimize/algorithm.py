"""The contract of every search algorithm: ask for candidates, tell how good they are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.optimize.space import Space

__all__ = ["Algorithm", "State"]

State = dict[str, Any]
"""Values that JSON keeps exactly, by name."""


class Algorithm(ABC):
    """A search that minimises, one generation at a time: `tell(asked := ask(), fitness)`.

    Whatever is random comes from `generator`. `state()` holds all that later generations depend on,
    so that an algorithm of the same options which restores it goes on bit for bit the same.

    Args:
        space: what is searched; every candidate is inside.
        seed: of the generator.
    """

    name: ClassVar[str]
    goals: int = 1

    def __init__(self, space: Space, seed: int) -> None:
        self.space = space
        self.seed = seed
        self.generator = np.random.default_rng(seed)

    @property
    @abstractmethod
    def options(self) -> State:
        """Its options; a search goes on only with the same options."""

    @abstractmethod
    def ask(self) -> NDArray[np.float64]:
        """Return the next generation's candidates, (n, d) [unit of each variable], all inside."""

    @abstractmethod
    def tell(self, candidates: NDArray[np.float64], fitness: NDArray[np.float64]) -> None:
        """Take the fitness of the candidates, less is better.

        Args:
            candidates: as asked, (n, d) [unit of each variable].
            fitness: (n,), or (n, goals) where an algorithm has several goals [unit of each goal];
                finite.
        """

    @abstractmethod
    def state(self) -> State:
        """Return, between a `tell` and the next `ask`, all that is to come depends on."""

    @abstractmethod
    def restore(self, state: State) -> None:
        """Take up a state that an algorithm of the same space and options gave."""

    def _generator_state(self) -> State:
        return dict(self.generator.bit_generator.state)

    def _restore_generator(self, state: State) -> None:
        try:
            self.generator.bit_generator.state = state
        except (TypeError, ValueError, KeyError) as error:
            raise InputError(f"the state of the random generator is not usable: {error}") from None
