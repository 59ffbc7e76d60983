"""TimeSeries: values over time with names, units and a mask of what is valid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.errors import did_you_mean

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["TimeSeries"]

_SHOWN = 6  # columns that its text names


@dataclass(frozen=True)
class TimeSeries:
    """Columns sampled at common times.

    Args:
        times: (n,) [s], strictly increasing.
        values: (n, k) [units named].
        names: k column names; by custom they end in the unit, `foot_x_m`.
        valid: (n, k) True where the sample was really seen.

    Raises:
        ValueError: when the shapes do not agree or the times do not increase.
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    names: tuple[str, ...]
    valid: NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Check shapes and order once, so that no reader has to."""
        n, k = len(self.times), len(self.names)
        if self.values.shape != (n, k) or self.valid.shape != (n, k):
            raise ValueError(
                f"TimeSeries of {n} times and {k} names has values {self.values.shape} "
                f"and valid {self.valid.shape}; both must be ({n}, {k})"
            )
        if len(set(self.names)) != k:
            raise ValueError(f"TimeSeries names repeat: {sorted(self.names)}")
        if n > 1 and not np.all(np.diff(self.times) > 0):
            at = int(np.argmin(np.diff(self.times) > 0)) + 1
            raise ValueError(f"TimeSeries times do not increase at sample {at}")

    @classmethod
    def of(
        cls,
        times: ArrayLike,
        columns: Mapping[str, ArrayLike],
        valid: Mapping[str, NDArray[np.bool_]] | None = None,
    ) -> TimeSeries:
        """Build from one (n,) array a column; a column not in `valid` is valid where finite.

        Args:
            times: (n,) [s], increasing.
            columns: name -> (n,) [unit named].
            valid: name -> (n,) True where the sample was really seen.
        """
        # a column is one piece of memory
        values = np.array([np.asarray(c, dtype=float) for c in columns.values()]).T
        mask = np.isfinite(values)
        for i, name in enumerate(columns):
            if valid is not None and name in valid:
                mask[:, i] &= valid[name]
        return cls(np.asarray(times, dtype=float), values, tuple(columns), mask)

    def __repr__(self) -> str:
        """Return it in one line; its numbers fill a screen."""
        span = f", {self.times[0]:g} s to {self.times[-1]:g} s" if len(self) else ""
        more = f", and {len(self.names) - _SHOWN} more" if len(self.names) > _SHOWN else ""
        return f"TimeSeries({len(self)} samples{span}: {', '.join(self.names[:_SHOWN])}{more})"

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.times)

    def __contains__(self, name: object) -> bool:
        """Return whether a column of that name exists."""
        return name in self.names

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Return one column, (n,); its invalid samples may be NaN or filled."""
        return self.values[:, self._index(name)]

    def validity(self, name: str) -> NDArray[np.bool_]:
        """Return the mask of one column, (n,)."""
        return self.valid[:, self._index(name)]

    def table(self) -> pa.Table:
        """Return `time_s` and the columns as an Arrow table; null where nothing was seen.

        Where pandas is installed, `.to_pandas()` of the table makes a frame of it.
        """
        import pyarrow as pa

        columns = {"time_s": pa.array(self.times)}
        for name in self.names:
            unseen = ~self.validity(name) | np.isnan(self[name])
            columns[name] = pa.array(self[name], mask=unseen)
        return pa.table(columns)

    def shifted(self, seconds: float) -> TimeSeries:
        """Return the series with `seconds` added to every time."""
        return TimeSeries(self.times + seconds, self.values, self.names, self.valid)

    def between(self, start: float, stop: float) -> TimeSeries:
        """Return the samples with start <= time <= stop [s]."""
        keep = (self.times >= start) & (self.times <= stop)
        return TimeSeries(self.times[keep], self.values[keep], self.names, self.valid[keep])

    def select(self, names: Iterable[str]) -> TimeSeries:
        """Return the columns named, in that order."""
        index = [self._index(name) for name in names]
        chosen = tuple(self.names[i] for i in index)
        return TimeSeries(self.times, self.values[:, index], chosen, self.valid[:, index])

    def replaced(self, columns: Mapping[str, NDArray[np.float64]]) -> TimeSeries:
        """Return the series with other values in some of its columns; the mask stays.

        Args:
            columns: name -> (n,) [unit named].
        """
        values = self.values.copy()
        for name, column in columns.items():
            values[:, self._index(name)] = column
        return TimeSeries(self.times, values, self.names, self.valid)

    def at(self, times: NDArray[np.float64]) -> TimeSeries:
        """Interpolate linearly to other times.

        A sample is valid only where both neighbours are, and never outside the series; of fewer
        than two samples none is.

        Args:
            times: (m,) [s].
        """
        if len(self) < 2:
            shape = (len(times), len(self.names))
            return TimeSeries(times, np.full(shape, np.nan), self.names, np.zeros(shape, bool))
        right = np.clip(np.searchsorted(self.times, times), 1, len(self) - 1)
        left = right - 1
        weight = (times - self.times[left]) / (self.times[right] - self.times[left])
        inside = (times >= self.times[0]) & (times <= self.times[-1])
        values = np.empty((len(times), len(self.names)))
        valid = np.empty(values.shape, dtype=bool)
        for i in range(len(self.names)):
            a, b = self.values[left, i], self.values[right, i]
            values[:, i] = np.where(weight == 0, a, np.where(weight == 1, b, a + weight * (b - a)))
            seen_left = self.valid[left, i] | (weight == 1)
            seen_right = self.valid[right, i] | (weight == 0)
            valid[:, i] = inside & seen_left & seen_right
        values[~inside] = np.nan
        return TimeSeries(np.asarray(times, dtype=float), values, self.names, valid)

    def _index(self, name: str) -> int:
        if name not in self.names:
            there = ", ".join(self.names) + did_you_mean(name, self.names)
            raise KeyError(f"no column {name!r}; there are {there}")
        return self.names.index(name)
