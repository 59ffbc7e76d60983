"""Read TRC files: labelled markers as text between tabs, no poses, so bodies come from the labels.

Three rows of header (names of keys, their values below), one row of labels, each over three
columns, one of axes, then a row a frame: its number, its time, x, y and z of each marker.
"""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.clock import column_rate, is_rate, jitter, motive_times, warn_of_index_steps
from workbench.tracking.labels import bodies_by_label, warn_of_no_bodies
from workbench.tracking.missing import without_zeros
from workbench.tracking.source import Source, shown
from workbench.tracking.take import Cloud, Take, known

__all__ = ["is_trc", "parse_trc"]

_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
_LEAD = 2  # columns before the markers: frame and time
_LABELS_ROW = 3  # from 0, among rows that are not blank
_DATA_ROW = 5


def is_trc(data: memoryview) -> bool:
    """Recognize a TRC file by its first word."""
    return re.match(rb"[\xef\xbb\xbf \t\r\n]*PathFileType", data) is not None


def parse_trc(source: Source) -> Take:
    """Turn the text of a TRC file into a take without poses.

    Raises:
        TakeError: the file cannot be used; the message names file, line and cause.
    """
    rows = [
        (number, line.rstrip("\r\n").split("\t"))
        for number, line in enumerate(source.text().splitlines(), start=1)
        if line.strip()
    ]
    if len(rows) <= _DATA_ROW:
        fault = f"this .trc file has {len(rows)} rows; a header of five and data are needed"
        raise source.fault(rows[-1][0], fault)
    header = _header(rows[1][1], rows[2][1])
    labels = _labels(*rows[_LABELS_ROW], source)
    table, lines = _table(rows[_DATA_ROW:], len(labels), source)
    indices = table[:, 0].astype(np.int64)
    unit = header.get("Units", "").casefold()
    if unit not in _METRES:
        raise source.fault(
            rows[2][0], f"Units is {shown(header.get('Units', ''))}; known are {', '.join(_METRES)}"
        )
    since, column = indices - indices[0], table[:, 1] - table[0, 1]
    rate = _rate(header, since, column, rows[2][0], source)
    warn_of_index_steps(indices, source)
    stated = header.get("NumFrames", "")
    if stated != str(len(table)):
        source.warn(f"the header says {shown(stated)} frames, the file has {len(table)}")
    places = source.checked(table[:, _LEAD:].reshape(len(table), -1, 3), lines, "a marker")
    places = np.where(known(places)[:, :, None], _METRES[unit] * places, np.nan)
    places = without_zeros(places, "markers", indices, source.warn)
    bodies, loose = bodies_by_label(labels, places, source)
    if not bodies:
        warn_of_no_bodies(labels, places, rows[_LABELS_ROW][0], source)
    names = np.array([labels[k] for k in loose], dtype=object)
    return Take(
        path=source.path,
        sha256=source.sha256(),
        format="trc",
        version=rows[0][1][1] if len(rows[0][1]) > 1 else "",
        rate_hz=rate,
        jitter_s=jitter(indices, table[:, 1]),
        indices=indices,
        times=table[0, 1] + motive_times(since, column, rate, source),
        bodies=bodies,
        cloud=Cloud(places[:, loose], np.broadcast_to(names, (len(places), len(loose)))),
        header=header,
        warnings=tuple(source.warnings),
        unit_m=_METRES[unit],
    )


def _header(keys: list[str], values: list[str]) -> dict[str, str]:
    return {k.strip(): v.strip() for k, v in zip(keys, values, strict=False) if k.strip()}


def _labels(line: int, cells: list[str], source: Source) -> list[str]:
    """Return the labels; each is above the first of its three columns."""
    names = [(at, cell.strip()) for at, cell in enumerate(cells) if cell.strip()][_LEAD:]
    columns = [at for at, _ in names]
    if not names or columns[0] != _LEAD or any(b - a != 3 for a, b in pairwise(columns)):
        raise source.fault(line, "the labels are not above three columns each, from the third")
    return [name for _, name in names]


def _table(
    rows: list[tuple[int, list[str]]], markers: int, source: Source
) -> tuple[NDArray[np.float64], list[int]]:
    """Return the numbers (n, 2 + 3 markers), NaN where blank, and the line of each row."""
    width = _LEAD + 3 * markers
    values: list[list[float]] = []
    for line, cells in rows:
        if len(cells) < width or any(cell.strip() for cell in cells[width:]):
            raise source.fault(
                line, f"the row has {len(cells)} cells; {markers} markers need {width}"
            )
        frame = source.count(cells[0], line, "the frame number", lowest=-(10**9))
        values.append([frame, *source.numbers(cells[1:width], line, range(1, width))])
    return np.array(values), [line for line, _ in rows]


def _rate(
    header: dict[str, str],
    indices: NDArray[np.int64],
    times: NDArray[np.float64],
    line: int,
    source: Source,
) -> float:
    """Return the rate of the header, else that of the times [Hz]."""
    text = header.get("DataRate", "")
    try:
        rate = float(text)
    except ValueError:
        rate = float("nan")
    if is_rate(rate):
        return rate
    measured = column_rate(indices, times)
    if measured is None:
        raise source.fault(line, f"DataRate is {shown(text)} and the times give none")
    source.warn(f"DataRate is {shown(text)}; {measured:.6g} Hz found from the times")
    return measured
