"""Rows that lie apart in a file, read as one text."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

__all__ = ["Pieces"]

_NEWLINE = ord("\n")


class Pieces(io.RawIOBase):
    """A stream of rows, joined only as they are asked for: the whole text never stands in memory.

    Args:
        data: the file's bytes.
        begins: (k,) where each piece begins; every piece is of whole rows.
        ends: (k,) one past where it ends.
    """

    def __init__(self, data: bytes, begins: NDArray[np.intp], ends: NDArray[np.intp]) -> None:
        super().__init__()
        self._data, self._begins, self._ends = data, begins, ends
        self._stops = np.cumsum(ends - begins)  # within the text
        self._next = 0
        self.quotes = 0
        """Quotes in what was read so far."""

    def first_row(self) -> bytes:
        """Return the first row, wherever the stream stands."""
        return self._data[self._begins[0] : self._ends[0]].partition(b"\n")[0]

    def most_rows(self) -> int:
        """Return how many rows there are if none is blank."""
        ends = zip(self._begins.tolist(), self._ends.tolist(), strict=True)
        return sum(self._data.count(b"\n", a, b) + (self._data[b - 1] != _NEWLINE) for a, b in ends)

    def readable(self) -> bool:
        """Tell that it can be read."""
        return True

    def read(self, size: int = -1) -> bytes:
        """Return whole pieces of together at most `size` bytes, but at least one; all below 0."""
        start = self._next
        done = int(self._stops[start - 1]) if start else 0
        fitting = int(np.searchsorted(self._stops, done + size, side="right"))
        stop = len(self._stops) if size < 0 else max(fitting, start + 1)
        self._next = min(stop, len(self._stops))
        begins, ends = self._begins[start:stop].tolist(), self._ends[start:stop].tolist()
        text = b"".join([self._data[a:b] for a, b in zip(begins, ends, strict=True)])
        self.quotes += text.count(b'"')
        return text
