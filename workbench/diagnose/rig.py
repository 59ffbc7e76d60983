"""The rig contract: what a diagnosis needs to know about a mechanical system.

A rig tells what was observed in each run, which numbers of its model may be other than stated, by
which causes the model may be extended, and predicts what would have been observed. The engine knows
nothing else: the hopping robot is one rig, any MJCF file with measured channels another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Asked",
    "Cause",
    "Effects",
    "Experimental",
    "Fault",
    "Forgetful",
    "Observed",
    "Rig",
    "Trial",
    "Unknown",
    "Windowed",
]

Effects = Mapping[str, Mapping[str, tuple[float, float]]]
"""Cause -> quantity -> value and standard error, SI."""

Asked = tuple[int, Mapping[str, float]]
"""Run, and the values of its unknowns by name; what is not named is as stated."""


@dataclass(frozen=True)
class Unknown:
    """One number that may be other than stated.

    Args:
        name: unique among base and causes (`effect.quantity` for a cause's); those of a run are
            unique within the run.
        unit: SI.
        stated: what the model says; zero for a quantity of a cause.
        tolerance: how far the truth may lie from it, in the same unit. A number of the base
            stays near it; one of a run has it as its standard deviation; one of a cause may be
            larger, but is expected to be of this size.
        low: least that is physically possible.
        high: greatest that is.
        step: of a finite difference.
        exact: whether derivatives by it need the steps that runs are compared in.
    """

    name: str
    unit: str
    stated: float
    tolerance: float
    low: float
    high: float
    step: float
    exact: bool = False

    @property
    def positive(self) -> bool:
        """Tell whether it is a positive number, which a fit changes by shares."""
        return self.stated > 0 and self.low >= 0


@dataclass(frozen=True)
class Cause:
    """One way to extend the model.

    Args:
        name: canonical.
        group: kind of cause; `sensor` ones mean that the data are at fault, `numerics` the step or
            the mesh of the simulation.
        sentence: for people; `{quantity}` stands for its value with unit, `{quantity:size}` for how
            large it is, and `{quantity:heavier|lighter}` for the word that its sign asks for.
        unknowns: its quantities, all stated zero.
        shows_in: modes of runs in which it shows; empty means all.
        confused_with: names of causes that look alike.
        separated_by: what tells it from those.
        replaces: base numbers that this cause is the release of: `hinge_stiffness` as a cause is
            the base's hinge stiffness beyond its tolerance. Its one quantity is what the numbers
            exceed their stated values by: a share where its unit is 1, else in their unit.
        dear: whether it takes several times as long to simulate a model that has it.
    """

    name: str
    group: str
    sentence: str
    unknowns: tuple[Unknown, ...]
    shows_in: tuple[str, ...] = ()
    confused_with: tuple[str, ...] = ()
    separated_by: str = ""
    replaces: tuple[str, ...] = ()
    dear: bool = False


@dataclass(frozen=True, eq=False)
class Observed:
    """What was observed in one run.

    Args:
        name: of the run.
        mode: what was done; runs of one mode are compared with each other.
        role: `train` runs are fitted; `held_out` ones only judge.
        times: (n,) [s], evenly spaced.
        values: (n, c) unfiltered.
        valid: (n, c) True where it was really seen.
        channels: c names.
        units: c units, `m` or `rad` and so on.
        rest: (r, c) samples while nothing moved, NaN where not seen; the noise is taken from them.
        forgets: whether its later seconds tell more of chance than of its start, as those of a hop.
    """

    name: str
    mode: str
    role: Literal["train", "held_out"]
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    valid: NDArray[np.bool_]
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rest: NDArray[np.float64]
    forgets: bool = False

    def until(self, end: float) -> Observed:
        """Return the same for a shorter time [s]."""
        keep = self.times <= end
        return replace(
            self, times=self.times[keep], values=self.values[keep], valid=self.valid[keep]
        )

    def also(
        self, times: NDArray[np.float64], values: NDArray[np.float64], valid: NDArray[np.bool_]
    ) -> Observed:
        """Return the same with more samples, later ones: (m,), (m, c), (m, c)."""
        return replace(
            self,
            times=np.concatenate([self.times, times]),
            values=np.concatenate([self.values, values]),
            valid=np.concatenate([self.valid, valid]),
        )


@dataclass(frozen=True)
class Fault:
    """What shows, before any fit, that a run is not what it is said to be.

    Args:
        run: its index.
        evidence: in a sentence, with what was said, what was measured and where to look.
    """

    run: int
    evidence: str


@dataclass(frozen=True)
class Trial:
    """A run that nobody has made yet.

    Args:
        mode: what would be done.
        amount: how much of it: a speed [rad/s], a pull [N] or a height [m], by the mode.
        duration: how long the system would move [s].
        rest: still time before [s].
    """

    mode: str
    amount: float
    duration: float
    rest: float


class Rig(Protocol):
    """A mechanical system with its runs."""

    @property
    def name(self) -> str:
        """Return what to call it."""
        ...

    @property
    def runs(self) -> Sequence[Observed]:
        """Return what was observed."""
        ...

    @property
    def base(self) -> Sequence[Unknown]:
        """Return the numbers of the model that are refitted within their tolerances."""
        ...

    @property
    def causes(self) -> Sequence[Cause]:
        """Return the ways to extend the model."""
        ...

    def own(self, run: int) -> Sequence[Unknown]:
        """Return what only one run knows: its start, its markers' places."""
        ...

    def faults(self) -> Sequence[Fault]:
        """Return which runs are not what they are said to be, as far as no fit is needed for it."""
        ...

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[NDArray[np.float64]]:
        """Return what would have been observed, (n, c) for each of those asked.

        Args:
            asked: run and values; all of them are simulated in one batch.
            until: only samples up to this time are needed [s]; the result has as many rows.
            coarse: whether larger steps will do, as they do for derivatives.

        A simulation that ends early repeats its last sample.
        """
        ...

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str
    ) -> Rig:
        """Write the extended model and return the rig of the file as read back, with the same runs.

        Args:
            path: of the new file, without its ending.
            values: of the base as refitted beside the effects.
            effects: cause -> quantity (without the cause's name) -> value and standard error.
            diagnosis: name of what it came from.
        """
        ...

    @property
    def source(self) -> Path:
        """Return the file that the model stands in."""
        ...


@runtime_checkable
class Forgetful(Rig, Protocol):
    """A rig some of whose runs forget how they began."""

    def shortened(self, ends: Mapping[int, float]) -> Rig:
        """Return the rig with some runs compared for a shorter time, also once it is extended.

        Args:
            ends: by run [s].
        """
        ...


@runtime_checkable
class Windowed(Rig, Protocol):
    """A rig whose runs that forget can be taken up again in between."""

    def in_windows(self, values: Mapping[int, Mapping[str, float]]) -> Rig | None:
        """Return the rig with some runs compared in short windows too, whose starts are free.

        Args:
            values: of the unknowns of each of these runs, near what is true.

        Returns:
            None where there are none.
        """
        ...


@runtime_checkable
class Experimental(Rig, Protocol):
    """A rig that can tell what runs would show that nobody has made yet."""

    def with_trials(self, trials: Sequence[Trial]) -> Rig:
        """Return the rig with more runs after its own: one a trial, all of it seen, values zero.

        They have no samples at rest. Base and causes are those of all runs together, so they may
        be more than before.
        """
        ...
