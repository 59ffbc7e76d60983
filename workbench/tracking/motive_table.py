"""The data rows of Motive's column format as one table of numbers."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.csv_columns import find_rows, read_columns
from workbench.tracking.motive_header import ColumnLayout
from workbench.tracking.source import Source, shown

__all__ = ["MotiveTable", "read_bulk", "read_strict", "read_table"]


@dataclass(frozen=True, eq=False)
class MotiveTable:
    """The columns that mean something, over n rows.

    Args:
        columns: k columns of the file, from 0.
        values: (k, n) NaN where blank [unit of the file].
    """

    columns: tuple[int, ...]
    values: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of rows."""
        return self.values.shape[1]

    @property
    def indices(self) -> NDArray[np.int64]:
        """(n,) the frame index of each row."""
        return self.values[0].astype(np.int64)

    def column(self, column: int) -> NDArray[np.float64]:
        """Return one column of the file, (n,) [unit of the file]."""
        return self.values[self.columns.index(column)]

    def block(self, columns: Sequence[int]) -> NDArray[np.float64]:
        """Return c columns side by side, (n, c) [unit of the file]; not to be written into.

        Samples run along the fast axis. Neighbouring columns are not copied.
        """
        return self.values[self.places(columns)].T

    def places(self, columns: Sequence[int]) -> slice | list[int]:
        """Return the rows of `values` with columns of the file."""
        at = [self.columns.index(column) for column in columns]
        is_range = at == list(range(at[0], at[0] + len(at)))
        return slice(at[0], at[0] + len(at)) if is_range else at

    @cached_property
    def blank(self) -> NDArray[np.bool_]:
        """(k, n) True where there is no number."""
        return np.isnan(self.values)


def read_table(layout: ColumnLayout, source: Source) -> MotiveTable:
    """Read the data rows, in bulk where they are many and plain.

    Raises:
        TakeError: a row cannot be used; the message names it and the cause.
    """
    return (source.large and read_bulk(layout, source)) or read_strict(layout, source)


def read_bulk(layout: ColumnLayout, source: Source) -> MotiveTable | None:
    """Read all rows at once, or return None where one of them is unusual."""
    start = source.after(layout.line)
    if start is None:
        return None
    rows = find_rows(source.data, start)
    rows = rows.of(rows.ends > rows.begins)
    if not len(rows):
        return None
    found = read_columns(rows, layout.width, layout.columns)
    if found is None or not _whole(found.numbers[0]).all():
        return None
    return MotiveTable(layout.columns, found.numbers)


def read_strict(layout: ColumnLayout, source: Source) -> MotiveTable:
    """Read row by row, with an error for the first one that cannot be used."""
    lines, values = array("l"), array("d")
    width = 0
    for line, cells in source.rows():
        if line <= layout.line:
            continue
        width = width or len(cells)
        _check_width(cells, width, line, layout, source)
        lines.append(line)
        values.extend(source.numbers([cells[i] for i in layout.columns], line, layout.columns))
    if not lines:
        raise source.fault(layout.line, "no data rows follow the header")
    table = np.frombuffer(values).reshape(len(lines), len(layout.columns))
    table = source.checked(table, lines, "a cell")
    wrong = np.flatnonzero(~_whole(table[:, 0]))
    if len(wrong):
        value = table[wrong[0], 0]
        found = "blank" if np.isnan(value) else f"{value:g}"
        raise source.fault(lines[int(wrong[0])], f"the frame index is {found}, not a whole number")
    return MotiveTable(layout.columns, np.ascontiguousarray(table.T))


def _whole(indices: NDArray[np.float64]) -> NDArray[np.bool_]:
    return indices == np.round(indices)


def _check_width(
    cells: Sequence[str], width: int, line: int, layout: ColumnLayout, source: Source
) -> None:
    """Refuse a row in which cells were lost or added: the cells after them would be misread.

    Args:
        cells: of the row.
        width: cells of the first data row; a spreadsheet gives all rows the same trailing commas.
        line: of the row.
        layout: of the file.
        source: the file.
    """
    if len(cells) < layout.width:
        raise source.fault(
            line,
            f"the row is cut short: {len(cells)} cells, {layout.width} are needed; export the take "
            "again and copy it whole",
        )
    surplus = next((cell for cell in cells[layout.width :] if cell.strip()), None)
    if surplus is not None:
        raise source.fault(
            line,
            f"the row has {len(cells)} cells, the header names {layout.width}; "
            f"{shown(surplus)} is beyond them",
        )
    if len(cells) != width:
        raise source.fault(line, f"the row has {len(cells)} cells, the first data row {width}")
