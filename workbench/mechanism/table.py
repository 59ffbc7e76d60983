"""Tables of measured columns, CSV or Parquet, read and checked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError

__all__ = ["Table", "require_even"]

_UNEVEN = 0.5  # of a step
_HEAD = 1  # lines of a CSV file above its first row


class Table:
    """A file of columns with a head line.

    Args:
        path: a CSV or Parquet file that exists.

    Raises:
        InputError: when it cannot be read as a table.
    """

    def __init__(self, path: Path) -> None:
        import pyarrow as pa
        from pyarrow import csv, parquet

        self.path = path
        try:
            self._table = (
                parquet.read_table(path) if path.suffix == ".parquet" else csv.read_csv(path)
            )
        except (pa.ArrowInvalid, OSError) as error:
            raise InputError(f"{path}: cannot be read as a table: {error}") from None

    @property
    def names(self) -> list[str]:
        """Return the names of the columns."""
        return self._table.column_names

    def column(self, name: str) -> NDArray[np.float64]:
        """Return a column, (n,) [unit of the column], NaN where the cell is empty.

        Raises:
            InputError: with the line of a cell that is no number.
        """
        import pyarrow as pa

        column = self._table.column(name)
        if pa.types.is_null(column.type):
            return np.full(len(column), np.nan)
        try:
            return column.cast(pa.float64()).to_numpy(zero_copy_only=False)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            cells = enumerate(column.to_pylist())
            row, cell = next((i, cell) for i, cell in cells if not _is_number(cell))
            raise InputError(
                f"{self.place(row)}: {name} is {cell!r}; it must be a number, or nothing where "
                "it was not seen"
            ) from None

    def known(self, name: str) -> NDArray[np.float64]:
        """Return the column of an input, (n,) [unit of the column].

        Raises:
            InputError: with the line of a cell that is empty.
        """
        found = self.column(name)
        if not np.isfinite(found).all():
            row = int(np.argmin(np.isfinite(found)))
            raise InputError(
                f"{self.place(row)}: input {name} is empty; what acted must be known at every "
                "sample"
            )
        return found

    def clock(self, name: str) -> NDArray[np.float64]:
        """Return the column of times, (n,) [s].

        Raises:
            InputError: with the line of a time that is missing or does not increase.
        """
        stamps = self.column(name)
        if not np.isfinite(stamps).all():
            row = int(np.argmin(np.isfinite(stamps)))
            words = "a sample without a time; every row needs one"
            raise InputError(f"{self.place(row)}: {words}")
        late = np.diff(stamps) <= 0
        if late.any():
            row = int(np.argmax(late)) + 1
            raise InputError(
                f"{self.place(row)}: time {stamps[row]:g} s follows {stamps[row - 1]:g} s; times "
                "must increase"
            )
        return stamps

    def place(self, row: int) -> str:
        """Return file and line of a row, from 0; a Parquet file has no lines but rows from 1."""
        if self.path.suffix == ".parquet":
            return f"{self.path}, row {row + 1}"
        return f"{self.path}:{row + _HEAD + 1}"


def require_even(table: Table, stamps: NDArray[np.float64]) -> None:
    """Refuse a clock that misses samples.

    Args:
        table: that it is of.
        stamps: (n,) of the clock [s].

    Raises:
        InputError: with the line after the gap.
    """
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    uneven = np.abs(steps - usual) > _UNEVEN * usual
    if uneven.any():
        row = int(np.argmax(uneven)) + 1
        raise InputError(
            f"{table.place(row)}: a step of {steps[row - 1]:g} s among steps of {usual:g} s; "
            "write samples that are missing as rows with empty cells, or resample"
        )


def _is_number(cell: object) -> bool:
    try:
        return cell is None or np.isfinite(float(str(cell)))
    except ValueError:
        return False
