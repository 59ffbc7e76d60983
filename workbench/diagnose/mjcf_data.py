"""Measured runs of a rig: tables of times, inputs and outputs, read and checked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.rig import Observed
from workbench.errors import FileFaults, InputError, did_you_mean
from workbench.protocol import Document, RigFile

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["RigData", "read_run"]

_UNEVEN = 0.5  # of a step
_LEAST = 10  # samples of a run
_HEAD = 1  # lines of a CSV file above its first row


@dataclass(frozen=True, eq=False)
class RigData:
    """One run as read.

    Args:
        seen: its outputs; its times begin with the simulation.
        input_times: (m,) of the same clock [s], from the first row of the file on.
        inputs: (m, i) in the order of the rig's inputs.
    """

    seen: Observed
    input_times: NDArray[np.float64]
    inputs: NDArray[np.float64]


def read_run(rig: Document[RigFile], index: int, units: tuple[str, ...]) -> RigData:
    """Read the data of one run.

    Args:
        rig: the rig file.
        index: of the run in it.
        units: of its channels, SI.

    Raises:
        FileFaults: at the line of the rig file, for a file or column that is not there.
        InputError: with file and line, for data that cannot be used.
    """
    run, content = rig.content.runs[index], rig.content
    path = rig.path.parent / run.data
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob("*.*")) if path.parent.is_dir() else []
        words = f"data: {path} is no file{did_you_mean(path.name, near)}"
        raise FileFaults([rig.fault(("runs", index, "data"), words)])
    table = _table(path)
    columns = {name: c.column or name for name, c in content.channels.items()}
    inputs = {name: c.column or name for name, c in content.inputs.items()}
    _require_columns(rig, index, table, [content.time, *columns.values(), *inputs.values()])
    stamps = _column(path, table, content.time)
    _require_even(path, stamps)
    begins = float(stamps[0]) if run.begins is None else run.begins
    if not stamps[0] <= begins <= stamps[-1]:
        words = f"begins: {begins:g} s is not within {stamps[0]:g} and {stamps[-1]:g} s of {path}"
        raise FileFaults([rig.fault(("runs", index, "begins"), words)])
    values = _scaled(path, table, columns, {n: c.scale for n, c in content.channels.items()})
    given = _scaled(path, table, inputs, {n: c.scale for n, c in content.inputs.items()})
    _require_inputs(path, given, tuple(inputs.values()))
    begun = stamps >= begins
    valid = np.isfinite(values)
    seen = Observed(
        name=run.name or path.stem,
        mode=run.mode,
        role="held_out" if run.role == "held_out" else "train",
        times=stamps[begun] - begins,
        values=np.nan_to_num(values[begun]),
        valid=valid[begun],
        channels=tuple(columns),
        units=units,
        rest=values[~begun],
    )
    return RigData(seen, stamps - begins, given)


def _table(path: Path) -> pa.Table:
    import pyarrow as pa
    from pyarrow import csv, parquet

    try:
        if path.suffix == ".parquet":
            return parquet.read_table(path)
        return csv.read_csv(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from None


def _require_columns(
    rig: Document[RigFile], index: int, table: pa.Table, wanted: list[str]
) -> None:
    names = table.column_names
    faults = [
        rig.fault(
            ("runs", index, "data"),
            f"{rig.content.runs[index].data} has no column {name!r}{did_you_mean(name, names)}; "
            f"it has {', '.join(names)}",
        )
        for name in wanted
        if name not in names
    ]
    if faults:
        raise FileFaults(faults)


def _column(path: Path, table: pa.Table, name: str) -> NDArray[np.float64]:
    """Return a column, NaN where the cell is empty."""
    import pyarrow as pa

    column = table.column(name)
    if pa.types.is_null(column.type):
        return np.full(len(column), np.nan)
    try:
        return column.cast(pa.float64()).to_numpy(zero_copy_only=False)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
        row, cell = next((i, c) for i, c in enumerate(column.to_pylist()) if not _is_number(c))
        raise InputError(
            f"{_place(path, row)}: {name} is {cell!r}; it must be a number, or nothing where "
            "it was not seen"
        ) from None


def _is_number(cell: object) -> bool:
    try:
        return cell is None or np.isfinite(float(str(cell)))
    except ValueError:
        return False


def _scaled(
    path: Path, table: pa.Table, columns: dict[str, str], scales: dict[str, float]
) -> NDArray[np.float64]:
    """Return columns in the order of their names, (n, c) in SI."""
    found = [_column(path, table, column) * scales[name] for name, column in columns.items()]
    return np.column_stack(found) if found else np.empty((table.num_rows, 0))


def _require_even(path: Path, stamps: NDArray[np.float64]) -> None:
    if len(stamps) < _LEAST:
        raise InputError(f"{path}: {len(stamps)} samples; a run needs at least {_LEAST}")
    if not np.isfinite(stamps).all():
        row = int(np.argmin(np.isfinite(stamps)))
        raise InputError(f"{_place(path, row)}: a sample without a time; every row needs one")
    steps = np.diff(stamps)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        raise InputError(
            f"{_place(path, row)}: time {stamps[row]:g} s follows {stamps[row - 1]:g} s; times "
            "must increase"
        )
    usual = float(np.median(steps))
    uneven = np.abs(steps - usual) > _UNEVEN * usual
    if uneven.any():
        row = int(np.argmax(uneven)) + 1
        raise InputError(
            f"{_place(path, row)}: a step of {steps[row - 1]:g} s among steps of {usual:g} s; "
            "write samples that are missing as rows with empty cells, or resample"
        )


def _require_inputs(path: Path, given: NDArray[np.float64], columns: tuple[str, ...]) -> None:
    missing = ~np.isfinite(given)
    if missing.any():
        row, column = (int(i) for i in np.argwhere(missing)[0])
        raise InputError(
            f"{_place(path, row)}: input {columns[column]} is empty; what acted must be known at "
            "every sample"
        )


def _place(path: Path, row: int) -> str:
    """Return file and line of a row, from 0; a Parquet file has no lines but rows from 1."""
    if path.suffix == ".parquet":
        return f"{path}, row {row + 1}"
    return f"{path}:{row + _HEAD + 1}"
