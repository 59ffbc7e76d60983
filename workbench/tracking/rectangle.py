"""Read rows of CSV text that all have the same number of cells, in bulk.

What is not plain is declined, never judged: the csv module then reads the same rows one by one and
names line and cause. Where it answers, the answer is the one that the csv module gives.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.pieces import Pieces
from workbench.tracking.source import LARGEST

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["Rectangle", "Words", "read_rectangle"]

_BLOCK = 4 << 20  # bytes that one thread converts at a time
_CHUNK = 1 << 18  # bytes searched for quotes at a time, so that they stay in the cache
_BLANKS = ["", "NAN", "nan", "NaN", "1.#QNAN", "-1.#QNAN", "1.#IND", "-1.#IND"]
_WHOLLY_QUOTED = re.compile(r'"[^"]*"')


@dataclass(frozen=True, eq=False)
class Words:
    """A column of texts that repeat.

    Args:
        codes: (n,) places in `vocabulary`.
        vocabulary: the different texts, without quotes around them.
    """

    codes: NDArray[np.int32]
    vocabulary: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Rectangle:
    """The columns asked for.

    Args:
        numbers: (k, n) the columns of numbers in the order asked for, NaN where blank.
        words: the columns of texts in the order asked for.
    """

    numbers: NDArray[np.float64]
    words: tuple[Words, ...]


def read_rectangle(
    text: bytes | memoryview | Pieces,
    width: int,
    numbers: Sequence[int],
    words: Sequence[int] = (),
    encoding: str = "utf-8",
) -> Rectangle | None:
    """Read columns of rows that have `width` cells each.

    Args:
        text: the rows.
        width: cells in each of them.
        numbers: columns that hold numbers or are blank, from 0.
        words: columns that hold text.
        encoding: of the text.

    Returns:
        The columns, or None where a row, a quote or a number is out of the ordinary.
    """
    import pyarrow as pa
    from pyarrow import csv

    names, word = [str(column) for column in range(width)], pa.dictionary(pa.int32(), pa.binary())
    kinds = {names[i]: pa.float64() for i in numbers} | {names[i]: word for i in words}
    together = not isinstance(text, Pieces)
    try:
        table = csv.read_csv(
            pa.BufferReader(pa.py_buffer(text)) if together else pa.PythonFile(text, mode="r"),
            csv.ReadOptions(column_names=names, block_size=_BLOCK),
            csv.ParseOptions(quote_char=False),
            csv.ConvertOptions(
                column_types=kinds,
                include_columns=list(kinds),
                null_values=_BLANKS,
                quoted_strings_can_be_null=False,
            ),
        )
    except pa.ArrowInvalid:
        return None
    values = _numbers(table, [names[i] for i in numbers])
    texts = tuple(_words(table[names[i]], encoding) for i in words)
    quotes = _quotes(text) if together else text.quotes
    if values is None or quotes != sum(_enclosing(words) for words in texts):
        return None
    return Rectangle(values, tuple(_unquoted(words) for words in texts))


def _numbers(table: pa.Table, names: Sequence[str]) -> NDArray[np.float64] | None:
    """Return (k, n), or None where a number is no measured one: `nan(...)`, `inf`, 1e300."""
    values = np.empty((len(names), table.num_rows))
    blanks = 0
    for row, name in zip(values, names, strict=True):
        column, at = table[name], 0
        blanks += column.null_count
        for chunk in column.chunks:
            row[at : at + len(chunk)] = chunk.to_numpy(zero_copy_only=False)
            at += len(chunk)
    if np.count_nonzero(np.isnan(values)) != blanks:
        return None
    lowest, highest = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
    return None if lowest < -LARGEST or highest > LARGEST else values


def _words(column: pa.ChunkedArray, encoding: str) -> Words:
    """Return a column of texts as they stand, with their quotes."""
    column = column.unify_dictionaries()
    codes = [chunk.indices.to_numpy(zero_copy_only=False) for chunk in column.chunks]
    entries = column.chunk(0).dictionary.to_pylist()
    return Words(np.concatenate(codes), tuple(entry.decode(encoding) for entry in entries))


def _quotes(text: bytes | memoryview) -> int:
    buffer = np.frombuffer(text, np.uint8)
    pieces = (buffer[start : start + _CHUNK] for start in range(0, len(buffer), _CHUNK))
    return sum(int(np.count_nonzero(piece == ord('"'))) for piece in pieces)


def _enclosing(words: Words) -> int:
    """Return how many quotes in a column stand around a whole cell."""
    times = np.bincount(words.codes, minlength=len(words.vocabulary))
    return sum(
        2 * int(count)
        for text, count in zip(words.vocabulary, times, strict=True)
        if _WHOLLY_QUOTED.fullmatch(text)
    )


def _unquoted(words: Words) -> Words:
    plain = (text[1:-1] if _WHOLLY_QUOTED.fullmatch(text) else text for text in words.vocabulary)
    return Words(words.codes, tuple(plain))
