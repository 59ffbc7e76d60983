"""What a fit may change, and how the numbers of a minimiser become values with units.

A parameter says by itself where it belongs and how it acts; nothing follows from its name. The
minimiser sees x = 0 at the nominal value and x = 1 one prior deviation above it; a parameter that
must stay positive moves in logarithms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["LIMITS", "Acts", "Known", "Parameter", "ParameterVector", "Scope", "beyond"]

Array = NDArray[np.float64]


class Scope(StrEnum):
    """Whose value it is: the model's, a candidate's that extends the model, or one run's."""

    MODEL = "model"
    CANDIDATE = "candidate"
    RUN = "run"


class Acts(StrEnum):
    """Where it acts: in the equations, on where a run starts, on its drive, or on what is seen."""

    MODEL = "model"
    START = "start"
    DRIVE = "drive"
    OBSERVATION = "observation"


@dataclass(frozen=True)
class Parameter:
    """One number that a fit may change.

    Args:
        name: as it is reported.
        unit: SI.
        nominal: its stated value.
        deviation: of its prior [unit]; scales the minimiser's number even where the prior is flat.
        low: least value allowed [unit].
        high: greatest value allowed [unit].
        scope: whose it is.
        acts: where it acts.
        run: number of the run that it belongs to; -1 for all runs.
        positive: whether it moves in logarithms.
        flat: whether its prior is left out of the likelihood.
        released: whether its prior is Cauchy's, not normal: what is far beyond its tolerance is
            believed less, but where the runs insist it may be.
    """

    name: str
    unit: str
    nominal: float
    deviation: float
    low: float = -np.inf
    high: float = np.inf
    scope: Scope = Scope.MODEL
    acts: Acts = Acts.MODEL
    run: int = -1
    positive: bool = False
    flat: bool = False
    released: bool = False

    @property
    def share(self) -> float:
        """Return the prior deviation as a share of the nominal value."""
        return self.deviation / self.nominal

    def value(self, x: float) -> float:
        """Return the value at a minimiser's number."""
        if self.positive:
            return float(self.nominal * np.exp(self.share * x))
        return float(self.nominal + self.deviation * x)

    def number(self, value: float) -> float:
        """Return the minimiser's number of a value."""
        if self.positive:
            return float(np.log(value / self.nominal) / self.share)
        return float((value - self.nominal) / self.deviation)


LIMITS = 3**0.5
"""Tolerance of a number over its standard deviation: that of a rectangular distribution within it
(JCGM 100:2008, 4.3.7)."""


_NEAR = 1e-6  # prior deviations


def beyond(x: Array) -> Array:
    """Return -2 ln of Cauchy's prior of released numbers, (k,) [1].

    A mass that was weighed is rarely off by many tolerances, but where the runs insist it may be.

    Args:
        x: (k,) numbers [prior deviations].
    """
    return 2 * np.log1p(x**2)


@dataclass(frozen=True, eq=False)
class Known:
    """What other runs say of some numbers: a normal distribution, their prior beside these runs.

    Args:
        names: of the parameters.
        at: (k,) the most likely numbers [prior deviations].
        root: (k, k) R with R'R their precision [1].
    """

    names: tuple[str, ...]
    at: Array
    root: Array

    @property
    def precision(self) -> Array:
        """Return the precision of the numbers, (k, k) [1]."""
        return np.asarray(self.root.T @ self.root, dtype=np.float64)


@dataclass(frozen=True)
class ParameterVector:
    """The parameters of one fit, in the order of the minimiser's numbers.

    Args:
        parameters: in that order.
        known: of some, what takes the place of their own priors; None where nothing is.
    """

    parameters: tuple[Parameter, ...]
    known: Known | None = None

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.parameters)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Return the least and greatest of the minimiser's numbers, (p,) each [1]."""
        low = [-np.inf if p.positive and p.low <= 0 else p.number(p.low) for p in self.parameters]
        return np.array(low), np.array([p.number(p.high) for p in self.parameters])

    @property
    def weighted(self) -> NDArray[np.bool_]:
        """Return which have a prior in the likelihood, (p,)."""
        return np.array([not p.flat for p in self.parameters], dtype=np.bool_)

    @cached_property
    def _released(self) -> NDArray[np.bool_]:
        """Return which of those that have a prior have Cauchy's, (k,)."""
        return np.array([p.released for p in self.parameters if not p.flat], dtype=np.bool_)

    @cached_property
    def _known(self) -> NDArray[np.intp]:
        """Return which of those that have a prior are known of other runs, (k,)."""
        names = [p.name for p in self.parameters if not p.flat]
        known = () if self.known is None else self.known.names
        return np.array([names.index(name) for name in known], dtype=np.intp)

    def priors(self, x: Array) -> Array:
        """Return the residuals of the k priors, (k,) [1]: their squares are -2 ln of the priors.

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        own = x[self.weighted]
        found = np.where(self._released, np.sign(own) * np.sqrt(beyond(own)), own)
        if self.known is not None:
            found[self._known] = self.known.root @ (own[self._known] - self.known.at)
        return found

    def prior_slopes(self, x: Array) -> Array:
        """Return the derivatives of `priors`, (k, p) [1].

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        weighted = np.flatnonzero(self.weighted)
        own, slopes = x[weighted], np.zeros((len(weighted), len(x)))
        near = np.abs(own) < _NEAR  # where the root's slope is that of its first term
        root = np.sqrt(beyond(np.where(near, 1.0, own)))
        released = np.where(near, np.sqrt(2), 2 * np.abs(own) / (1 + own**2) / root)
        slopes[np.arange(len(weighted)), weighted] = np.where(self._released, released, 1.0)
        if self.known is not None:
            slopes[np.ix_(self._known, weighted[self._known])] = self.known.root
        return slopes

    def values(self, x: Array) -> dict[Parameter, float]:
        """Return the value of each parameter [its unit].

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        return {p: p.value(float(v)) for p, v in zip(self.parameters, x, strict=True)}

    def numbers(self, values: Mapping[Parameter, float]) -> Array:
        """Return the numbers (p,) [1] of values; a parameter that is not given is nominal."""
        return np.array([p.number(values.get(p, p.nominal)) for p in self.parameters])

    def named(self, values: Mapping[str, float]) -> Array:
        """Return the numbers (p,) [1] of values by name; what is not given is nominal."""
        return np.array([p.number(values.get(p.name, p.nominal)) for p in self.parameters])

    @property
    def own(self) -> NDArray[np.bool_]:
        """Return which belong to single runs, (p,)."""
        return np.array([p.scope is Scope.RUN for p in self.parameters], dtype=np.bool_)

    @property
    def shared(self) -> list[Parameter]:
        """Return the parameters that are no single run's."""
        return [p for p in self.parameters if p.scope is not Scope.RUN]

    def touching(self, run: int) -> Sequence[int]:
        """Return which parameters act on a run."""
        return [i for i, p in enumerate(self.parameters) if p.run in (-1, run)]
