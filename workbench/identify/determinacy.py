"""Which parameters the runs tell apart, and which only act together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.identify.solution import Solution

__all__ = ["Combination", "undetermined"]

_WEAK = 0.5  # of its tolerance: a direction that the data leave as unsure as this is not told
_MEMBER = 0.2  # share of the strongest member of a combination
_ALIKE = 0.1


@dataclass(frozen=True)
class Combination:
    """A direction in which the parameters can move and the data do not notice.

    Args:
        exponents: parameter -> the power of it that moves; the greatest is 1.
        spread: standard deviation along it, in tolerances.
    """

    exponents: Mapping[str, float]
    spread: float

    @property
    def names(self) -> tuple[str, ...]:
        """Return the parameters that it mixes."""
        return tuple(self.exponents)

    def __str__(self) -> str:
        """Say what the data do tell, or that they tell nothing."""
        names, powers = list(self.exponents), list(self.exponents.values())
        if len(names) == 1:
            return f"{names[0]}: the data do not depend on it"
        if len(names) == 2 and abs(abs(powers[0] / powers[1]) - 1) < _ALIKE:
            kind, sign = ("product", "*") if powers[0] * powers[1] < 0 else ("ratio", "/")
            return f"{names[0]} {sign} {names[1]}: only this {kind} is determined"
        mixed = ", ".join(f"{name}^{power:.2g}" for name, power in self.exponents.items())
        return f"a common change of {mixed} is not determined"


def undetermined(solution: Solution, tolerances: Mapping[str, float]) -> list[Combination]:
    """Return the combinations of parameters that the data leave open.

    Args:
        solution: with its Jacobian.
        tolerances: of each fitted parameter, as a share of its value.
    """
    names = solution.problem.names
    scale = np.array([tolerances[name] for name in names])
    count = len(names)
    # eliminate what only the runs know; what is left is the information about the parameters
    information = solution.information
    own = information[count:, count:]
    cross = information[:count, count:]
    left = information[:count, :count] - cross @ np.linalg.solve(own, cross.T)
    strength, directions = np.linalg.eigh(scale[:, None] * left * scale)
    found = []
    for value, direction in zip(strength, directions.T, strict=True):
        spread = 1 / np.sqrt(max(value, 1e-12))
        if spread <= _WEAK:
            continue
        powers = direction * scale
        powers = powers / powers[np.abs(powers).argmax()]
        members = {n: float(p) for n, p in zip(names, powers, strict=True) if abs(p) > _MEMBER}
        found.append(Combination(members, float(spread)))
    return found
