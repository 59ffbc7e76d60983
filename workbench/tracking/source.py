"""The text of one export file: rows with line numbers, and errors that name the line."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.errors import TakeError

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

__all__ = ["LARGE", "LARGEST", "Source", "listed", "shown", "unique_name"]

LARGEST = 1e9
"""Beyond any coordinate, time or index; keeps later arithmetic from overflowing."""
LARGE = 8_000_000
"""Bytes from which a file is read in bulk."""
_SHOWN = 40
_LISTED = 8


@dataclass(frozen=True)
class Source:
    """A file's text, and the warnings of its parsers.

    Args:
        path: the file's name as the user gave it.
        sha256: returns the hash of the file's bytes, which is computed meanwhile.
        data: the file's bytes.
        encoding: of the text in them.
        warnings: filled by the parsers.
    """

    path: str
    sha256: Callable[[], str]
    data: bytes | memoryview
    encoding: str = "utf-8-sig"
    warnings: list[str] = field(default_factory=list)

    @property
    def plain_encoding(self) -> str:
        """The encoding of any part of the text but its beginning."""
        return self.encoding.removesuffix("-sig")

    def text(self) -> str:
        """Return the whole text, without a byte order mark."""
        return str(self._unmarked, self.encoding)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield line number (from 1) and cells of each row that is not blank."""
        # decoded as it is read: a StringIO would hold four bytes a character
        stream = io.BufferedReader(_Stream(self._unmarked))
        reader = csv.reader(io.TextIOWrapper(stream, encoding=self.encoding, newline=""))
        while True:
            try:
                cells = next(reader, None)
            except csv.Error as error:
                raise self.fault(reader.line_num, f"not readable as CSV ({error})") from error
            if cells is None:
                return
            if any(cells):
                yield reader.line_num, cells

    def fault(self, line: int, cause: str) -> TakeError:
        """Return the error for one line."""
        return TakeError(f"{self.path}:{line}: {cause}")

    def warn(self, text: str) -> None:
        """Add a warning once."""
        if text not in self.warnings:
            self.warnings.append(text)

    @property
    def large(self) -> bool:
        """Whether reading in bulk saves more than the import of its compiled loops."""
        return len(self.data) >= LARGE

    def after(self, line: int) -> int | None:
        """Return the end of a line, or None where the lines before have different line ends."""
        ends = [found.end() for found in islice(re.finditer(rb"\n", self.data), line)]
        if len(ends) < line:
            return None
        head = bytes(self.data[: ends[-1]])
        return None if head.count(b"\r") > head.count(b"\r\n") else len(head)

    def warn_once(self, text: str, line: int) -> None:
        """Add a warning with the first line that it is about."""
        if not any(warning.startswith(text) for warning in self.warnings):
            self.warn(f"{text}, first in line {line}")

    def numbers(self, cells: Sequence[str], line: int, columns: Sequence[int]) -> list[float]:
        """Convert cells to numbers; blank, NAN and the old C runtime's `1.#QNAN` become NaN.

        Args:
            cells: the texts.
            line: their line, for the message.
            columns: their columns, from 0, for the message.

        Raises:
            TakeError: where a cell holds anything else.
        """
        try:
            return list(map(float, cells))
        except ValueError:
            pairs = zip(cells, columns, strict=True)
            return [self._number(cell, line, column + 1) for cell, column in pairs]

    def count(self, cell: str, line: int, what: str, lowest: int = 0) -> int:
        """Convert a cell to a whole number of at least `lowest`."""
        try:
            value = float(cell)
        except ValueError:
            value = float("nan")
        if not lowest <= value <= LARGEST or value != int(value):
            raise self.fault(
                line, f"{what} is {shown(cell)}; a whole number from {lowest} belongs there"
            )
        return int(value)

    def checked(
        self, values: NDArray[np.float64], lines: Sequence[int], what: str
    ) -> NDArray[np.float64]:
        """Return values, (n, ...) [as given], with infinities as NaN; refuse absurd magnitudes.

        Args:
            values: (n, ...) [any unit].
            lines: of each of the n.
            what: they are, for the message.
        """
        values = np.where(np.isfinite(values), values, np.nan)
        absurd = np.abs(values) > LARGEST
        if absurd.any():
            at = int(np.argwhere(absurd)[0][0])
            found = values[absurd].flat[0]
            raise self.fault(lines[at], f"{what} has the value {found:g}; not a measured number")
        return values

    @property
    def _unmarked(self) -> bytes | memoryview:
        mark = codecs.BOM_UTF8
        return self.data[len(mark) :] if self.data[: len(mark)] == mark else self.data

    def _number(self, cell: str, line: int, column: int) -> float:
        text = cell.strip(" \t")
        if not text or "#" in text:
            return float("nan")
        try:
            return float(text)
        except ValueError:
            hint = " (decimal comma? export with points)" if "," in text else ""
            raise self.fault(
                line, f"column {column} holds {shown(cell)} where a number belongs{hint}"
            ) from None


class _Stream(io.RawIOBase):
    """A file that reads from memory without a copy of all of it, as `io.BytesIO` makes."""

    def __init__(self, data: bytes | memoryview) -> None:
        self._rest = memoryview(data)

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: WriteableBuffer) -> int:
        """Fill a buffer; return how much of it."""
        room = memoryview(buffer)
        count = min(len(room), len(self._rest))
        room[:count], self._rest = self._rest[:count], self._rest[count:]
        return count


def shown(text: str) -> str:
    """Return a cell for a message: quoted and cut to a readable length."""
    return repr(text if len(text) <= _SHOWN else text[:_SHOWN] + "...")


def listed(names: Iterable[str]) -> str:
    """Return different names for a message: the first eight, and how many there are besides."""
    each = list(dict.fromkeys(names))
    more = f" and {len(each) - _LISTED} more" if len(each) > _LISTED else ""
    return (", ".join(map(shown, each[:_LISTED])) or "nothing") + more


def unique_name(name: str, taken: Sequence[str], source: Source) -> str:
    """Return the name, numbered and with a warning when the file uses it twice."""
    if name not in taken:
        return name
    number = 2
    while f"{name} ({number})" in taken:
        number += 1
    source.warn(f"two bodies are named {name!r}; the later one is read as '{name} ({number})'")
    return f"{name} ({number})"
