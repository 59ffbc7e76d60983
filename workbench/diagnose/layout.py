"""All unknowns of a diagnosis in one row, scaled: zero is as stated, one is a tolerance away."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.rig import Cause, Rig, Unknown

__all__ = ["Layout"]

_OWN_REACH = 8.0  # deviations that a number of one run may lie off
_EDGE = 1.5  # tolerances: clutter moves a number that lies at its edge a little beyond
_LARGEST = 1e6


class Layout:
    """Where each unknown of a rig stands in the row of all of them.

    The base comes first, then the causes, then what each run keeps to itself. Positive numbers are
    scaled by shares, so that a step never makes them negative.
    """

    def __init__(self, rig: Rig) -> None:
        self.causes: dict[str, Cause] = {cause.name: cause for cause in rig.causes}
        unknowns: list[Unknown] = list(rig.base)
        self.of_cause: dict[str, NDArray[np.int_]] = {}
        for cause in rig.causes:
            self.of_cause[cause.name] = len(unknowns) + np.arange(len(cause.unknowns))
            unknowns += cause.unknowns
        runs = [-1] * len(unknowns)
        for k in range(len(rig.runs)):
            own = rig.own(k)
            unknowns += own
            runs += [k] * len(own)
        self.unknowns = tuple(unknowns)
        self.run = np.array(runs)
        self.base = np.arange(len(rig.base))

    def __len__(self) -> int:
        """Return how many unknowns there are."""
        return len(self.unknowns)

    @cached_property
    def shared(self) -> NDArray[np.int_]:
        """Return the indices of all that no run has to itself."""
        return np.flatnonzero(self.run < 0)

    def own(self, run: int | None = None) -> NDArray[np.int_]:
        """Return the indices of what one run, or any run, has to itself."""
        return np.flatnonzero(self.run >= 0 if run is None else self.run == run)

    @cached_property
    def releases(self) -> tuple[str, ...]:
        """Return the causes that are base numbers beyond their tolerance."""
        return tuple(name for name, cause in self.causes.items() if cause.replaces)

    @cached_property
    def numerics(self) -> tuple[str, ...]:
        """Return the causes that are the step or the mesh of the simulation."""
        return tuple(name for name, cause in self.causes.items() if cause.group == "numerics")

    @cached_property
    def dear(self) -> tuple[str, ...]:
        """Return the causes that take several times as long to simulate."""
        return tuple(name for name, cause in self.causes.items() if cause.dear)

    def quantities(self, names: tuple[str, ...]) -> NDArray[np.int_]:
        """Return the indices of the quantities of some causes."""
        none = np.empty(0, dtype=np.int_)
        return np.concatenate([none, *(self.of_cause[name] for name in names)])

    def replaced(self, names: tuple[str, ...]) -> NDArray[np.int_]:
        """Return the indices of the base numbers that some causes are the releases of."""
        of = {self.unknowns[i].name: int(i) for i in self.base}
        released = [number for name in names for number in self.causes[name].replaces]
        return np.array([of[number] for number in released if number in of], dtype=np.int_)

    def taken_over(self, z: NDArray[np.float64], names: tuple[str, ...]) -> NDArray[np.float64]:
        """Return the place where some causes take over the base numbers that they release, (u,).

        The number goes back to what is stated and its release takes the whole difference: with both
        free one could go out and the other come back, and be called a cause. A release of several
        cannot take over each one's difference; those stay where they are.

        Args:
            z: (u,) scaled unknowns.
            names: of causes.
        """
        there = z.copy()
        for name in names:
            numbers = self.replaced((name,))
            for i in numbers if len(numbers) == 1 else ():
                at = int(self.of_cause[name][0])
                stated, release = self.unknowns[i].stated, self.unknowns[at]
                before, after = self.value(int(i), float(z[i])), self.value(at, float(z[at]))
                if release.unit == "1":
                    whole = before * (1 + after) / stated - 1
                else:
                    whole = before + after - stated
                there[i], there[at] = 0.0, whole / release.tolerance
        return there

    @cached_property
    def steps(self) -> NDArray[np.float64]:
        """Return the scaled steps of finite differences, (u,)."""
        return np.array([u.step / u.tolerance for u in self.unknowns])

    @cached_property
    def exact(self) -> NDArray[np.bool_]:
        """Return which unknowns are derived by in the steps that runs are compared in, (u,)."""
        return np.array([u.exact for u in self.unknowns])

    @cached_property
    def low(self) -> NDArray[np.float64]:
        """Return the scaled lower bounds, (u,)."""
        return np.array([self._bound(i, -1) for i in range(len(self))])

    @cached_property
    def high(self) -> NDArray[np.float64]:
        """Return the scaled upper bounds, (u,)."""
        return np.array([self._bound(i, 1) for i in range(len(self))])

    def value(self, i: int, z: float) -> float:
        """Return an unknown in its unit."""
        unknown = self.unknowns[i]
        if unknown.positive:
            return float(unknown.stated * np.exp(z * unknown.tolerance / unknown.stated))
        return float(unknown.stated + z * unknown.tolerance)

    def values(self, z: NDArray[np.float64], run: int) -> dict[str, float]:
        """Return what a run is predicted from; quantities of absent causes are left out.

        Args:
            z: (u,) scaled unknowns.
            run: whose own unknowns count.
        """
        chosen = np.concatenate([self.base, np.flatnonzero(self.run == run)])
        values = {self.unknowns[i].name: self.value(i, float(z[i])) for i in chosen}
        for members in self.of_cause.values():
            if np.any(z[members]):
                values |= {self.unknowns[i].name: self.value(i, float(z[i])) for i in members}
        return values

    def _bound(self, i: int, side: int) -> float:
        unknown = self.unknowns[i]
        if self.run[i] >= 0:
            return side * _OWN_REACH
        limit = unknown.low if side < 0 else unknown.high
        if unknown.positive:
            share = np.log(max(limit, 1e-9) / unknown.stated) * unknown.stated / unknown.tolerance
        else:
            share = (limit - unknown.stated) / unknown.tolerance
        if i < len(self.base):
            return float(np.clip(share, -_EDGE, _EDGE))
        return float(np.clip(share, -_LARGEST, _LARGEST))
