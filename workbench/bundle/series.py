"""Time series as Parquet, with the mask of what was seen and the hashes of what they come from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from workbench.bundle.writing import replaced
from workbench.errors import InputError
from workbench.timeseries import TimeSeries

__all__ = ["read_parquet", "write_parquet"]

_TIME = "time_s"
_VALID = "valid:"


def write_parquet(path: Path, series: TimeSeries, made_from: Mapping[str, str]) -> None:
    """Write a time series; the file is there whole or not at all.

    Raises:
        RecordError: when it cannot be written.
    """
    columns: dict[str, NDArray[np.generic]] = {_TIME: series.times}
    columns |= {name: series[name] for name in series.names}
    for name in series.names:
        if not series.validity(name).all():
            columns[_VALID + name] = series.validity(name)
    table = pa.table(columns).replace_schema_metadata({"made_from": json.dumps(dict(made_from))})
    with replaced(path) as draft:
        # measured numbers seldom repeat: a dictionary of them costs time and space
        pq.write_table(table, draft, use_dictionary=False)


def read_parquet(path: Path) -> TimeSeries:
    """Read a time series back.

    Raises:
        InputError: when it is missing or damaged.
    """
    try:
        table = pq.read_table(path)
        columns = {name: table[name].to_numpy() for name in table.column_names}
        times = columns.pop(_TIME)
        masks = {n.removeprefix(_VALID): c for n, c in columns.items() if n.startswith(_VALID)}
        values = {n: c for n, c in columns.items() if not n.startswith(_VALID)}
        valid = [masks.get(name, np.ones(len(times), dtype=bool)) for name in values]
        return TimeSeries(
            times, np.column_stack(list(values.values())), tuple(values), np.column_stack(valid)
        )
    except (pa.ArrowException, OSError, KeyError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
