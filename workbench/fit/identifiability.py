"""Which parameters the data separate: the null space of the scaled information.

What only single runs know is eliminated, and what its tolerance holds; what is left is scaled by
the parameters' prior deviations. A direction along which the data leave more than half a deviation
is not determined: its parameters act together, and only what remains of them is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.fit.fitting import Fit, settled
from workbench.fit.intervals import covariance
from workbench.fit.parameters import Parameter, ParameterVector, Scope
from workbench.progress import Progress

__all__ = ["Combination", "separable", "undetermined"]

Array = NDArray[np.float64]

_WEAK = 0.5  # of the prior deviation
_MEMBER = 0.2  # share of the strongest member
_ALIKE = 0.1
_NOTHING = 1e-12  # an information of nothing


@dataclass(frozen=True)
class Combination:
    """A direction in which parameters can move without a trace in the data.

    Args:
        powers: parameter -> the power of it that moves, of its value where it is positive; the
            greatest is 1.
        deviation: along it, in prior deviations.
    """

    powers: Mapping[str, float]
    deviation: float

    @property
    def names(self) -> tuple[str, ...]:
        """Return the parameters that it mixes."""
        return tuple(self.powers)

    def __str__(self) -> str:
        """Say what the data determine, or that they determine nothing."""
        names, powers = list(self.powers), list(self.powers.values())
        if len(names) == 1:
            return f"{names[0]}: the data do not depend on it"
        if len(names) == 2 and abs(abs(powers[0] / powers[1]) - 1) < _ALIKE:
            kind, sign = ("product", "*") if powers[0] * powers[1] < 0 else ("ratio", "/")
            return f"{names[0]} {sign} {names[1]}: only this {kind} is determined"
        mixed = ", ".join(f"{name}^{power:.2g}" for name, power in self.powers.items())
        return f"a common change of {mixed} is not determined"


def undetermined(vector: ParameterVector, information: Array) -> list[Combination]:
    """Return the directions that the data leave open, the weakest first.

    Args:
        vector: of the parameters.
        information: (p, p) of the minimiser's numbers [1], priors included.
    """
    shared = np.array([_is_asked(p) for p in vector.parameters])
    own = ~shared
    left = information[np.ix_(shared, shared)]
    if own.any():
        cross = information[np.ix_(shared, own)]
        left = left - cross @ np.linalg.solve(information[np.ix_(own, own)], cross.T)
    strength, directions = np.linalg.eigh((left + left.T) / 2)
    members = [p for p in vector.parameters if _is_asked(p)]
    scale = np.array([p.share if p.positive else p.deviation for p in members])
    found = []
    for value, direction in zip(strength, directions.T, strict=True):
        deviation = 1 / np.sqrt(max(float(value), _NOTHING))
        if deviation <= _WEAK:
            continue
        powers = direction * scale
        powers = powers / powers[np.abs(powers).argmax()]
        kept = {p.name: float(w) for p, w in zip(members, powers, strict=True) if abs(w) > _MEMBER}
        found.append(Combination(kept, deviation))
    return found


def separable(fit: Fit, progress: Progress = lambda text: None) -> tuple[Fit, list[Combination]]:
    """Return the fit of what the data separate, and the directions that they leave open.

    Of each direction the parameter that was stated most exactly is held at its nominal value, the
    others are moved along and fitted again: they carry the product or ratio that is determined.
    """
    found: list[Combination] = []
    while open_ := undetermined(fit.vector, covariance(fit).information):
        worst = open_[0]
        found.append(worst)
        members = [p for p in fit.vector.parameters if p.name in worst.powers]
        held = min(members, key=_exactness)
        progress(f"{worst}; {held.name} stays at its nominal value")
        fit = _without(fit, held, worst)
    return fit, found


def _is_asked(parameter: Parameter) -> bool:
    """Return whether the data alone are to determine a parameter: no prior holds it."""
    return parameter.scope is not Scope.RUN and parameter.flat


def _exactness(parameter: Parameter) -> float:
    return parameter.share if parameter.positive else parameter.deviation


def _without(fit: Fit, held: Parameter, along: Combination) -> Fit:
    """Return the fit with a parameter at its nominal value, the others moved along."""
    parameters, x = fit.vector.parameters, fit.x.copy()
    k = parameters.index(held)
    direction = np.array([along.powers.get(p.name, 0.0) / _exactness(p) for p in parameters])
    x -= x[k] / direction[k] * direction
    kept = np.delete(np.arange(len(x)), k)
    vector = ParameterVector(tuple(parameters[i] for i in kept))
    return settled(replace(fit.estimator, vector=vector), x[kept])
