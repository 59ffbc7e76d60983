"""Read columns of CSV rows that all have the same number of cells, in bulk.

Unusual rows are declined: the csv module then reads the same rows one by one and names line and
cause. Otherwise the result is that of the csv module.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.parallel import parallel_map
from workbench.tracking.source import LARGEST

__all__ = ["ABSENT", "CsvColumns", "Rows", "find_rows", "read_columns"]

ABSENT = -1
"""A column that some rows do not have: NaN, and no word."""
_BLOCK = 1 << 21  # bytes that one thread reads at a time
_NEWLINE, _RETURN = b"\n\r"
_WHOLLY_QUOTED = re.compile(r'"[^"]*"')


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a text.

    Args:
        text: (size,) the bytes of the whole file.
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
        """Return some of the rows.

        Args:
            some: (n,) mask, or (k,) indices.
        """
        return Rows(self.text, self.begins[some], self.ends[some])

    def counted(self) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
        """Return the cells of each row (n,), and first and last bytes (2, n); 0 where blank."""
        from workbench.tracking.csv_cells import count_cells

        widths, edges = np.empty(len(self), np.int32), np.empty((2, len(self)), np.uint8)

        def count(some: slice) -> None:
            part = self.of(some)
            count_cells(part.text, part.begins, part.ends, widths[some], edges[:, some])

        list(parallel_map(count, _blocks(self)))
        return widths, edges


@dataclass(frozen=True, eq=False)
class CsvColumns:
    """Columns of n rows.

    Args:
        numbers: (k, n) the columns of numbers, NaN where blank [unit of each column].
        codes: (w, n) the columns of words, as indices into `vocabulary`.
        vocabulary: the different words of all columns, without quotes around them, and their code.
    """

    numbers: NDArray[np.float64]
    codes: NDArray[np.int32]
    vocabulary: dict[str, int] = field(default_factory=dict)

    @classmethod
    def empty(cls, numbers: int, words: int, n: int) -> CsvColumns:
        """Return room for n rows."""
        return cls(np.empty((numbers, n)), np.empty((words, n), np.int32))

    def used(self, columns: int | slice) -> dict[str, int]:
        """Return the words of some columns, and their code."""
        words = list(self.vocabulary)
        count = np.bincount(self.codes[columns].ravel() - ABSENT)[-ABSENT:]
        return {words[code]: code for code in np.flatnonzero(count).tolist()}

    def words(self, column: int) -> dict[str, NDArray[np.intp]]:
        """Return the rows, (r,) each, that hold each of the different words of a column."""
        found = self.used(column).items()
        return {word: np.flatnonzero(self.codes[column] == code) for word, code in found}


def find_rows(data: bytes | memoryview, start: int) -> Rows:
    """Find the rows from byte `start` on; one with a carriage return within it will be declined."""
    text = np.frombuffer(data, np.uint8)

    def stops(at: int) -> NDArray[np.int64]:
        return np.flatnonzero(text[at : at + _BLOCK] == _NEWLINE) + at

    some = parallel_map(stops, range(start, len(text), _BLOCK))
    ends = np.concatenate([np.empty(0, np.int64), *some])
    if start < len(text) and text[-1] != _NEWLINE:
        ends = np.append(ends, len(text))
    begins = np.concatenate(([start], ends[:-1] + 1))[: len(ends)]
    returned = (ends > begins) & (ends < len(text)) & (text[ends - 1] == _RETURN)
    return Rows(text, begins, ends - returned)


def read_columns(
    rows: Rows,
    width: int,
    numbers: Sequence[int],
    words: Sequence[int] = (),
    encoding: str = "utf-8",
    places: NDArray[np.intp] | None = None,
    found: CsvColumns | None = None,
) -> CsvColumns | None:
    """Read columns of rows that have `width` cells each.

    Blocks of rows are read in parallel, each number directly into the result.

    Args:
        rows: of a text, none of them blank.
        width: cells in each of them.
        numbers: columns that hold numbers or are blank, from 0, or `ABSENT`; as in the result.
        words: columns that hold text, likewise.
        encoding: of the text.
        places: (n,) indices of the rows in the result; in their own order if None.
        found: the result to fill, with rows of other kinds; a new one if None.

    Returns:
        The result, or None where a row, a quote, a carriage return or a number is unusual.
    """
    from workbench.tracking.csv_cells import SKIPPED, WORDS

    found = found or CsvColumns.empty(len(numbers), len(words), len(rows))
    places = np.arange(len(rows)) if places is None else places
    columns = np.full(width + 1, SKIPPED)  # the last one is that of ABSENT
    columns[list(numbers)] = np.arange(len(numbers))
    given = [row for row, column in enumerate(words) if column != ABSENT]
    columns[[words[row] for row in given]] = WORDS - np.arange(len(given))
    for table, each, nothing in ((found.numbers, numbers, np.nan), (found.codes, words, ABSENT)):
        for row in np.flatnonzero(np.equal(each, ABSENT)):
            table[row, places] = nothing

    def read(some: slice) -> tuple[NDArray[np.int32], list[bytes]] | None:
        return _read(rows.of(some), columns[:-1], len(given), found.numbers, places[some])

    blocks = _blocks(rows)
    for some, block in zip(blocks, parallel_map(read, blocks), strict=True):
        if block is None:
            return None
        texts = (_unquoted(word.decode(encoding)) for word in block[1])
        known = found.vocabulary
        moved = np.array([known.setdefault(text, len(known)) for text in texts], np.int32)
        for row, codes in zip(given, block[0], strict=True):
            found.codes[row, places[some]] = moved[codes]
    return found


def _blocks(rows: Rows) -> list[slice]:
    """Return parts of the rows that one thread reads at a time."""
    size = int((rows.ends - rows.begins).sum())
    edges = np.linspace(0, len(rows), size // _BLOCK + 2).astype(int).tolist()
    return [slice(*edge) for edge in pairwise(edges)]


def _read(
    rows: Rows,
    columns: NDArray[np.int64],
    words: int,
    values: NDArray[np.float64],
    places: NDArray[np.intp],
) -> tuple[NDArray[np.int32], list[bytes]] | None:
    """Fill in the numbers of a block of rows.

    Returns:
        Its words (w, rows) as indices into the different ones, or None where it is declined.
    """
    from workbench.tracking.csv_cells import number_words, read_cells

    texts = np.empty((words, len(rows), 2), np.int64)
    codes, odd = np.empty(texts.shape[:2], np.int32), np.empty((0, 4), np.int64)
    given = rows.text, rows.begins, rows.ends, columns, values, places, texts
    count = read_cells(*given, odd)
    if count > 0:  # again, with room for what is odd
        odd = np.empty((count, 4), np.int64)
        read_cells(*given, odd)
    if count < 0 or not _put_odd(odd, rows.text, values):
        return None
    different = number_words(rows.text, texts, codes) if words else ()
    return codes, [rows.text[begin:end].tobytes() for begin, end in different]


def _put_odd(odd: NDArray[np.int64], text: NDArray[np.uint8], values: NDArray[np.float64]) -> bool:
    """Convert the cells that the compiled loop did not; False where one is no plausible number."""
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
