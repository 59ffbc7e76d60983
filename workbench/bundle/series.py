"""Time series as Parquet, with the mask of what was seen and the hashes of what they come from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

from workbench.bundle.inside import foreign, require_file
from workbench.bundle.writing import replaced
from workbench.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from workbench.timeseries import TimeSeries

__all__ = ["Series", "SeriesFiles", "read_series", "write_series"]

Series = Literal["supply", "raw", "track", "twin", "state", "live"]

_TIME = "time_s"
_VALID = "valid:"


class SeriesFiles(NamedTuple):
    """The time series of one bundle. Numpy and pyarrow are loaded with the first one only.

    Args:
        folder: of the bundle.
    """

    folder: Path

    @property
    def kinds(self) -> tuple[Series, ...]:
        """Return which time series were written."""
        kinds: tuple[Series, ...] = get_args(Series)
        return tuple(kind for kind in kinds if self.has(kind))

    def has(self, kind: Series) -> bool:
        """Return whether a time series was written."""
        path = self._path(kind)
        return path.exists() and foreign(path) is None

    def write(self, kind: Series, series: TimeSeries, made_from: Mapping[str, str]) -> None:
        """Write a time series with the hashes of what it was made from; whole or not at all.

        Raises:
            RecordError: when it cannot be written.
        """
        write_series(self._path(kind), series, made_from)

    def read(self, kind: Series) -> TimeSeries:
        """Read a time series back.

        Raises:
            InputError: when it is missing, with those that there are, or damaged.
        """
        path = require_file(self._path(kind))
        if not path.exists():
            has = f"it has {', '.join(self.kinds) or 'none'}{did_you_mean(kind, self.kinds)}"
            raise InputError(f"{path}: cannot be read: the run has no such series; {has}")
        return read_series(path)

    def _path(self, kind: Series) -> Path:
        return self.folder / f"{kind}.parquet"


def write_series(path: Path, series: TimeSeries, made_from: Mapping[str, str]) -> None:
    """Write a time series with the hashes of what it was made from; whole or not at all.

    Raises:
        RecordError: when it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, NDArray[Any]] = {_TIME: series.times}
    columns |= {name: series[name] for name in series.names}
    for name in series.names:
        if not series.validity(name).all():
            columns[_VALID + name] = series.validity(name)
    hashes = {"made_from": json.dumps(dict(made_from))}
    table = pa.table(columns).replace_schema_metadata(hashes)
    with replaced(path) as draft:
        # measured numbers seldom repeat: a dictionary of them costs time and space
        pq.write_table(table, draft, use_dictionary=False)


def read_series(path: Path) -> TimeSeries:
    """Read a time series back.

    Raises:
        InputError: when it is missing or damaged.
    """
    import numpy as np
    import pyarrow as pa
    import pyarrow.parquet as pq

    from workbench.timeseries import TimeSeries

    try:
        with pq.ParquetFile(path) as file:  # `read_table` loads pyarrow's data sets for it
            table = file.read()
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
