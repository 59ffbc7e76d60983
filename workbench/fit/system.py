"""What a fit needs to know of a mechanical system: how to build, drive and observe it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from workbench.fit.gain import Modes
from workbench.fit.observer import Start
from workbench.fit.parameters import Parameter

__all__ = ["System"]

Array = NDArray[np.float64]


class System(Protocol):
    """A mechanical system and the runs that were measured of it."""

    @property
    def names(self) -> Sequence[str]:
        """Return the names of the runs."""
        ...

    @property
    def groups(self) -> Sequence[str]:
        """Return the names of the groups of joints that have a process noise of their own."""
        ...

    @property
    def strong(self) -> Mapping[str, float]:
        """Return each group's process noise that lets the observer follow a far model."""
        ...

    @property
    def sample_s(self) -> float:
        """Return the time from one sample to the next [s]."""
        ...

    @property
    def difference(self) -> float:
        """Return how long a difference is where nothing lands, of what it would be else."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return what is fitted: of the model, of candidates, then of single runs."""
        ...

    def seen(self, run: int) -> Array:
        """Return the measured channels of a run, (n, c) [unit of each], NaN where not seen."""
        ...

    def channels_of(self, run: int) -> Sequence[str]:
        """Return the names of its channels."""
        ...

    def feels(self, run: int, parameter: Parameter) -> bool:
        """Return whether a parameter of the model or of a candidate can change a run."""
        ...

    def lands(self, run: int) -> bool:
        """Return whether landings and slips make its residuals kinked in every parameter."""
        ...

    def drive_words(self, run: int) -> list[str]:
        """Return what its drive did otherwise than commanded, where beyond doubt."""
        ...

    def sigma(self, run: int) -> Array:
        """Return the standard deviation of their noise, (c,) [unit of each]."""
        ...

    def memory(self, run: int) -> Array:
        """Return the correlation of their noise with that of the sample before, (c,) [1]."""
        ...

    def modes(self, run: int) -> Modes:
        """Return the lowest modes about the rest of the nominal system."""
        ...

    def process(self, run: int, noise: Mapping[str, float]) -> Array:
        """Return the process noise of each degree of freedom, from that of the groups.

        Returns:
            (nv,) [N sqrt(s)] of what slides, [N m sqrt(s)] of what turns.
        """
        ...

    def refined(self, qpos: Sequence[Array]) -> System:
        """Return the system with inputs made from observed states.

        Args:
            qpos: (n, nq) of each run [m, rad].
        """
        ...

    def start(self, run: int, values: Mapping[Parameter, float], coarse: bool) -> Start:
        """Return the model of a run at its start.

        Args:
            run: its number.
            values: of the parameters that are not nominal.
            coarse: whether derivatives are taken of it: cheaper steps will do.

        Raises:
            InputError: when the values cannot be simulated.
        """
        ...
