"""The set that is searched: a box and, for some variables together, an interval of their sum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.errors import InputError

__all__ = ["Space"]

_ROUNDS = 64  # of drawing from the box before what is left is projected


@dataclass(frozen=True, eq=False)
class Space:
    """Box and sum: `lower <= x <= upper` and `sum_lower <= sum of the summed x <= sum_upper`.

    Args:
        names: of the d variables.
        lower: least value of each, (d,) [unit of each].
        upper: greatest value of each, (d,) [unit of each].
        start: where a search begins, (d,) [unit of each], inside.
        summed: names of the variables that the sum takes; empty for no sum.
        sum_lower: least sum.
        sum_upper: greatest sum.

    Raises:
        InputError: when the set is empty or the start is outside; names the variable.
    """

    names: tuple[str, ...]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    start: NDArray[np.float64]
    summed: tuple[str, ...] = ()
    sum_lower: float = -np.inf
    sum_upper: float = np.inf

    def __post_init__(self) -> None:
        """Check that the set is not empty and holds the start."""
        for name in ("lower", "upper", "start"):
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.shape != (len(self),):
                raise InputError(
                    f"{name} has shape {values.shape}; {len(self)} variables need ({len(self)},)"
                )
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        self._check_names()
        self._check_box()
        self._check_sum()
        self._check_start()

    def __len__(self) -> int:
        """Return d, the number of variables."""
        return len(self.names)

    @property
    def widths(self) -> NDArray[np.float64]:
        """How far each variable can go, (d,) [unit of each]."""
        return self.upper - self.lower

    @cached_property
    def in_sum(self) -> NDArray[np.bool_]:
        """Which variables the sum takes, (d,)."""
        taken = np.isin(self.names, self.summed)
        taken.flags.writeable = False
        return taken

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return which points are inside, (...,); bounds belong to the inside.

        Args:
            points: (..., d) [unit of each].
        """
        points = np.asarray(points, dtype=np.float64)
        boxed = np.all((points >= self.lower) & (points <= self.upper), axis=-1)
        sums = points[..., self.in_sum].sum(axis=-1)
        return boxed & (sums >= self.sum_lower) & (sums <= self.sum_upper)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the nearest points inside, in the Euclidean sense, (..., d) [unit of each].

        The nearest point of box and sum shifts all summed variables by one number and clips them:
        that number is a root of a piecewise linear function, found exactly between its corners.
        A shifted sum stops a rounding error short of the interval's end, so that it is inside in
        whatever order it is added up. What is inside stays as it is, bit for bit.

        Args:
            points: (..., d) [unit of each].
        """
        points = np.asarray(points, dtype=np.float64)
        flat = np.clip(points.reshape(-1, len(self)), self.lower, self.upper)
        sums = flat[:, self.in_sum].sum(axis=1)
        margin = self._rounding()
        for row in np.flatnonzero(~self._sum_is_safe(sums, margin)):
            target = np.clip(sums[row], self.sum_lower + 2 * margin, self.sum_upper - 2 * margin)
            free = points.reshape(-1, len(self))[row, self.in_sum]
            flat[row, self.in_sum] = _shifted(
                free, self.lower[self.in_sum], self.upper[self.in_sum], float(target)
            )
        return flat.reshape(points.shape)

    def sample(self, generator: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw points of the set, (count, d) [unit of each], evenly unless it is a thin slice."""
        drawn = generator.uniform(self.lower, self.upper, (count, len(self)))
        for _ in range(_ROUNDS):
            outside = ~self.contains(drawn)
            if not outside.any():
                break
            shape = (np.count_nonzero(outside), len(self))
            drawn[outside] = generator.uniform(self.lower, self.upper, shape)
        return self.project(drawn)

    def describe(self) -> dict[str, Any]:
        """Return what makes this space this one, as JSON knows it."""
        return {
            "names": list(self.names),
            "lower": self.lower.tolist(),
            "upper": self.upper.tolist(),
            "start": self.start.tolist(),
            "summed": list(self.summed),
            "sum_lower": self.sum_lower if np.isfinite(self.sum_lower) else None,
            "sum_upper": self.sum_upper if np.isfinite(self.sum_upper) else None,
        }

    def _rounding(self) -> float:
        """Return the most that two orders of adding up the summed variables can differ."""
        largest = np.maximum(np.abs(self.lower), np.abs(self.upper))[self.in_sum]
        return float(np.finfo(np.float64).eps * largest.size * largest.sum())

    def _sum_is_safe(self, sums: NDArray[np.float64], margin: float) -> NDArray[np.bool_]:
        return (sums >= self.sum_lower + margin) & (sums <= self.sum_upper - margin)

    def _check_names(self) -> None:
        if len(set(self.names)) < len(self):
            raise InputError(f"a variable is named twice in {', '.join(self.names)}")
        for name in self.summed:
            if name not in self.names:
                raise InputError(
                    f"the sum takes {name}, which is no variable of {', '.join(self.names)}"
                )

    def _check_box(self) -> None:
        for name, low, high in zip(self.names, self.lower, self.upper, strict=True):
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                raise InputError(
                    f"variable {name}: lower {low:g} and upper {high:g} leave nothing to search; "
                    "give two finite bounds, the lower one first, or take the variable out"
                )

    def _check_sum(self) -> None:
        low, high = self.lower[self.in_sum].sum(), self.upper[self.in_sum].sum()
        margin = 4 * self._rounding()
        least, most = max(low, self.sum_lower), min(high, self.sum_upper)
        if self.summed and not least + margin < most:
            raise InputError(
                f"the sum of {_listed(self.summed)} can be {low:g} to {high:g} within "
                f"the bounds, {self.sum_lower:g} to {self.sum_upper:g} is asked; widen one of them"
            )

    def _check_start(self) -> None:
        for name, value, low, high in zip(
            self.names, self.start, self.lower, self.upper, strict=True
        ):
            if not low <= value <= high:
                raise InputError(
                    f"variable {name}: the start {value:g} is outside {low:g} to {high:g}"
                )
        if not self.contains(self.start):
            raise InputError(
                f"the start's sum of {_listed(self.summed)} is "
                f"{self.start[self.in_sum].sum():g}, outside {self.sum_lower:g} to "
                f"{self.sum_upper:g}"
            )


def _shifted(
    free: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64], total: float
) -> NDArray[np.float64]:
    """Return clip(free - shift) for the shift that makes its sum the total."""
    corners = np.sort(np.concatenate([free - lower, free - upper]))
    sums = np.clip(free - corners[:, None], lower, upper).sum(axis=1)  # falls along the corners
    shift = np.interp(-total, -sums, corners)
    return np.clip(free - shift, lower, upper)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} ... {names[-1]}"
