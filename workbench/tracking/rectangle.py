"""Read rows of CSV text that all have the same number of cells, in bulk.

What is not plain is declined, never judged: the csv module then reads the same rows one by one and
names line and cause. Where it answers, the answer is the one that the csv module gives.
"""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.pieces import Pieces
from workbench.tracking.source import LARGEST

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["Rectangle", "Words", "read_rectangle"]

_BLOCK = 4 << 20  # bytes that one thread parses at a time
_ROW = 1 << 12  # bytes in which the end of a row is looked for
_WORKERS = os.cpu_count() or 1
_NEWLINE = ord("\n")
_CHUNK = 1 << 18  # bytes searched at a time, so that they stay in the cache
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

    Blocks of the text are parsed side by side, and each is put into its place among plain arrays at
    once: no table of the whole text ever stands in memory.

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

    whole = np.empty((len(numbers), _most_rows(text)))
    parts: list[_Part] = []
    under_way: deque[Future[_Part]] = deque()
    start = 0
    try:
        with ThreadPoolExecutor(_WORKERS) as pool:
            for block, rows in _blocks(text):
                if len(under_way) > _WORKERS:
                    parts.append(under_way.popleft().result())
                place = whole[:, start : start + rows]
                under_way.append(pool.submit(_parsed, block, width, numbers, words, place))
                start += rows
            parts.extend(each.result() for each in under_way)
        pa.default_memory_pool().release_unused()  # else it keeps a third of the file's size
    except (pa.ArrowInvalid, _Declined):
        return None
    quotes = text.quotes if isinstance(text, Pieces) else _count(text, b'"')
    texts = tuple(_joined([part.words[i] for part in parts], encoding) for i in range(len(words)))
    if quotes != sum(map(_enclosing, texts)):
        return None
    return Rectangle(_closed_up(whole, parts), tuple(map(_unquoted, texts)))


class _Declined(Exception):
    """A number is no measured one."""


class _Part(NamedTuple):
    """What came of a block: its place (k, rows), how many rows it has, its columns of text."""

    place: NDArray[np.float64]
    rows: int
    words: tuple[tuple[NDArray[np.int32], list[bytes]], ...]


def _most_rows(text: bytes | memoryview | Pieces) -> int:
    """Return how many rows a text has if none is blank."""
    if isinstance(text, Pieces):
        return text.most_rows()
    return _count(text, b"\n") + 1


def _blocks(text: bytes | memoryview | Pieces) -> Iterator[tuple[bytes | memoryview, int]]:
    """Yield the text in blocks of whole rows, and how many rows each has if none is blank."""
    if isinstance(text, Pieces):
        while block := text.read(_BLOCK):
            yield block, _count(block, b"\n") + (not block.endswith(b"\n"))
        return
    view, start = memoryview(text), 0
    while start < len(view):
        stop = min(start + _BLOCK, len(view))
        while stop < len(view):  # to the end of the row that is begun
            found = bytes(view[stop : stop + _ROW]).find(b"\n")
            stop = min(len(view), stop + (_ROW if found < 0 else found + 1))
            if found >= 0:
                break
        yield view[start:stop], _count(view[start:stop], b"\n") + (view[stop - 1] != _NEWLINE)
        start = stop


def _parsed(
    block: bytes | memoryview,
    width: int,
    numbers: Sequence[int],
    words: Sequence[int],
    place: NDArray[np.float64],
) -> _Part:
    """Parse one block in one thread, its numbers into their place (k, rows or more)."""
    import pyarrow as pa
    from pyarrow import csv

    names, word = [str(column) for column in range(width)], pa.dictionary(pa.int32(), pa.binary())
    kinds = {names[i]: pa.float64() for i in numbers} | {names[i]: word for i in words}
    table = csv.read_csv(
        pa.BufferReader(pa.py_buffer(block)),
        csv.ReadOptions(column_names=names, block_size=len(block) + 1, use_threads=False),
        csv.ParseOptions(quote_char=False),
        csv.ConvertOptions(
            column_types=kinds,
            include_columns=list(kinds),
            null_values=_BLANKS,
            quoted_strings_can_be_null=False,
        ),
    )
    _put_numbers(table, [names[i] for i in numbers], place[:, : table.num_rows])
    return _Part(place, table.num_rows, tuple(_words(table[names[i]]) for i in words))


def _put_numbers(table: pa.Table, names: Sequence[str], values: NDArray[np.float64]) -> None:
    """Fill (k, n); decline a number that is no measured one: `nan(...)`, `inf`, 1e300."""
    blanks = 0
    for row, name in zip(values, names, strict=True):
        column, at = table[name], 0
        blanks += column.null_count
        for chunk in column.chunks:
            row[at : at + len(chunk)] = chunk.to_numpy(zero_copy_only=False)
            at += len(chunk)
    if not values.size:
        return
    lowest, highest = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
    if np.count_nonzero(np.isnan(values)) != blanks or lowest < -LARGEST or highest > LARGEST:
        raise _Declined


def _closed_up(whole: NDArray[np.float64], parts: Sequence[_Part]) -> NDArray[np.float64]:
    """Return the numbers (k, n) without the room that was left for rows which are blank."""
    filled = sum(part.rows for part in parts)
    if all(part.rows == part.place.shape[1] for part in parts):
        return whole[:, :filled]
    return np.concatenate([part.place[:, : part.rows] for part in parts], axis=1)


def _words(column: pa.ChunkedArray) -> tuple[NDArray[np.int32], list[bytes]]:
    """Return a column of texts as they stand, with their quotes: codes and what they stand for."""
    column = column.unify_dictionaries()
    codes = [chunk.indices.to_numpy(zero_copy_only=False) for chunk in column.chunks]
    return np.concatenate(codes), column.chunk(0).dictionary.to_pylist()


def _joined(parts: Sequence[tuple[NDArray[np.int32], list[bytes]]], encoding: str) -> Words:
    """Return one column of the parts' texts, which each part has numbered in its own way."""
    places: dict[bytes, int] = {}
    codes = []
    for own, entries in parts:
        moved = [places.setdefault(entry, len(places)) for entry in entries]
        codes.append(np.array(moved, dtype=np.int32)[own])
    return Words(np.concatenate(codes), tuple(entry.decode(encoding) for entry in places))


def _count(text: bytes | memoryview, sign: bytes) -> int:
    """Return how often a byte stands in a text."""
    buffer = np.frombuffer(text, np.uint8)
    pieces = (buffer[start : start + _CHUNK] for start in range(0, len(buffer), _CHUNK))
    return sum(int(np.count_nonzero(piece == ord(sign))) for piece in pieces)


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
