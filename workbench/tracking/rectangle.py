"""Read rows of CSV text that all have the same number of cells, in bulk.

What is not plain is declined, never judged: the csv module then reads the same rows one by one and
names line and cause. Where it answers, the answer is the one that the csv module gives.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.source import LARGEST

__all__ = ["Rectangle", "Rows", "find_rows", "read_rectangle"]

_BLOCK = 1 << 21  # bytes that one thread reads at a time
_CHUNK = 1 << 18  # bytes searched at a time, so that they stay in the cache
_NEWLINE, _RETURN = b"\n\r"
_WHOLLY_QUOTED = re.compile(r'"[^"]*"')


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a text.

    Args:
        text: the bytes of the whole file.
        begins: (n,) where each row begins.
        ends: (n,) one past its content, the line end not included.
    """

    text: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.begins)

    def of(self, some: NDArray[np.bool_ | np.intp] | slice) -> Rows:
        """Return some of the rows."""
        return Rows(self.text, self.begins[some], self.ends[some])

    def widths(self) -> NDArray[np.int32]:
        """Return the number of cells of each row, 0 where it is blank."""
        from workbench.tracking.cells import count_cells

        widths = np.empty(len(self), np.int32)
        count_cells(self.text, self.begins, self.ends, widths)
        return widths


@dataclass(frozen=True, eq=False)
class Rectangle:
    """The columns asked for, over n rows.

    Args:
        numbers: (k, n) the columns of numbers in the order asked for, NaN where blank.
        codes: (w, n) the columns of words in the order asked for, as places in `vocabulary`.
        vocabulary: the different words of all columns, without quotes around them.
    """

    numbers: NDArray[np.float64]
    codes: NDArray[np.int32]
    vocabulary: tuple[str, ...]

    def words(self, column: int) -> dict[str, NDArray[np.intp]]:
        """Return the rows that hold each of the different words of a column."""
        codes = self.codes[column]
        used = np.flatnonzero(np.bincount(codes, minlength=len(self.vocabulary)))
        return {self.vocabulary[code]: np.flatnonzero(codes == code) for code in used}


def find_rows(data: bytes | memoryview, start: int) -> Rows:
    """Find the rows from a place on; one with a carriage return within it will be declined."""
    text = np.frombuffer(data, np.uint8)
    stops = [np.empty(0, np.int64)]
    for at in range(start, len(text), _CHUNK):
        stops.append(np.flatnonzero(text[at : at + _CHUNK] == _NEWLINE) + at)
    ends = np.concatenate(stops)
    if start < len(text) and text[-1] != _NEWLINE:
        ends = np.append(ends, len(text))
    begins = np.concatenate(([start], ends[:-1] + 1))[: len(ends)]
    returned = (ends > begins) & (ends < len(text)) & (text[ends - 1] == _RETURN)
    return Rows(text, begins, ends - returned)


def read_rectangle(
    rows: Rows,
    width: int,
    numbers: Sequence[int],
    words: Sequence[int] = (),
    encoding: str = "utf-8",
    places: NDArray[np.intp] | None = None,
) -> Rectangle | None:
    """Read columns of rows that have `width` cells each.

    Blocks of rows are read side by side, each number straight into its place in the result.

    Args:
        rows: of a text, none of them blank.
        width: cells in each of them.
        numbers: columns that hold numbers or are blank, from 0.
        words: columns that hold text.
        encoding: of the text.
        places: of the rows in the result, (n,); in their own order if None.

    Returns:
        The columns, or None where a row, a quote, a carriage return or a number is out of the
        ordinary.
    """
    from workbench.tracking.cells import SKIPPED, WORDS

    columns = np.full(width, SKIPPED)
    columns[list(numbers)] = np.arange(len(numbers))
    columns[list(words)] = WORDS - np.arange(len(words))
    values = np.empty((len(numbers), len(rows)))
    codes = np.empty((len(words), len(rows)), np.int32)
    size = int((rows.ends - rows.begins).sum())
    edges = np.linspace(0, len(rows), size // _BLOCK + 2).astype(int).tolist()
    blocks = [slice(*edge) for edge in pairwise(edges)]
    places = np.arange(len(rows)) if places is None else places
    vocabulary: dict[str, int] = {}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        read = pool.map(lambda some: _read(rows.of(some), columns, values, places[some]), blocks)
        for some, block in zip(blocks, read, strict=True):
            if block is None:
                return None
            texts = (_unquoted(word.decode(encoding)) for word in block[1])
            moved = [vocabulary.setdefault(text, len(vocabulary)) for text in texts]
            codes[:, places[some]] = np.array(moved, np.int32)[block[0]]
    return Rectangle(values, codes, tuple(vocabulary))


def _read(
    rows: Rows, columns: NDArray[np.int64], values: NDArray[np.float64], places: NDArray[np.intp]
) -> tuple[NDArray[np.int32], list[bytes]] | None:
    """Fill in the numbers of a block of rows.

    Returns:
        Its words (w, rows) as places among the different ones, or None where it is declined.
    """
    from workbench.tracking.cells import WORDS, number_words, read_cells

    words = np.empty((max(0, WORDS + 1 - min(columns)), len(rows), 2), np.int64)
    codes, odd = np.empty(words.shape[:2], np.int32), np.empty((0, 4), np.int64)
    given = rows.text, rows.begins, rows.ends, columns, values, places, words
    count = read_cells(*given, odd)
    if count > 0:  # again, with room for what is odd
        odd = np.empty((count, 4), np.int64)
        read_cells(*given, odd)
    if count < 0 or not _put_odd(odd, rows.text, values):
        return None
    different = number_words(rows.text, words, codes) if len(words) else ()
    return codes, [rows.text[begin:end].tobytes() for begin, end in different]


def _put_odd(odd: NDArray[np.int64], text: NDArray[np.uint8], values: NDArray[np.float64]) -> bool:
    """Convert what the compiled loop did not; tell whether all of it is measured numbers."""
    for place, row, begin, end in odd:
        cell = text[begin:end].tobytes()
        try:
            value = float(cell)
        except ValueError:
            return False
        if b"_" in cell or b"\r" in cell or abs(value) > LARGEST:
            return False
        values[place, row] = value
    return True


def _unquoted(text: str) -> str:
    return text[1:-1] if _WHOLLY_QUOTED.fullmatch(text) else text
