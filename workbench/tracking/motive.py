"""Read Motive's column format, versions 1.2 to 1.25."""

from __future__ import annotations

from workbench.tracking.clock import column_rate, is_rate, jitter, motive_times, warn_of_index_steps
from workbench.tracking.motive_bodies import bodies_and_cloud, scale
from workbench.tracking.motive_header import ColumnLayout, read_layout
from workbench.tracking.motive_table import MotiveTable, read_table
from workbench.tracking.source import Source, shown
from workbench.tracking.start_time import parse_start_time
from workbench.tracking.take import Take

__all__ = ["parse_motive"]

_VERSIONS = ("1.2", "1.21", "1.22", "1.23", "1.24", "1.25")


def parse_motive(source: Source) -> Take:
    """Turn the text of a Motive export into a take.

    Raises:
        TakeError: the file cannot be used; the message names file, line and cause.
    """
    layout = read_layout(source)
    table = read_table(layout, source)
    rate = _rate(layout, table, source)
    indices = table.indices
    column = None if layout.time_column is None else table.column(layout.time_column)
    times = motive_times(indices, column, rate, source)
    warn_of_index_steps(indices, source)
    _check_header(layout, len(indices), source)
    metres = scale(layout, source)
    bodies, cloud = bodies_and_cloud(layout, table, metres, rate, source)
    return Take(
        path=source.path,
        sha256=source.sha256(),
        format="motive",
        version=_version(layout, source),
        rate_hz=rate,
        jitter_s=jitter(indices, column),
        indices=indices,
        times=times,
        bodies=bodies,
        cloud=cloud,
        header=layout.header,
        warnings=tuple(source.warnings),
        began=parse_start_time(layout.header.get("Capture Start Time", "")),
        unit_m=metres,
        unit_stated=bool(layout.header.get("Length Units")),
    )


def _version(layout: ColumnLayout, source: Source) -> str:
    version = layout.header.get("Format Version", "")
    if version not in _VERSIONS:
        source.warn(f"format version {shown(version)} is not known; read like the nearest")
    return version


def _rate(layout: ColumnLayout, table: MotiveTable, source: Source) -> float:
    """Return the rate of the header, else that of the times [Hz]."""
    text = layout.header.get("Export Frame Rate", "")
    stated = _number(text)
    if is_rate(stated):
        return stated
    measured = None
    if layout.time_column is not None:
        captured = _number(layout.header.get("Capture Frame Rate", ""))
        measured = column_rate(table.indices, table.column(layout.time_column), captured)
    if measured is None or not is_rate(measured):
        raise source.fault(1, f"Export Frame Rate is {shown(text)} and the times give none")
    source.warn(f"Export Frame Rate is {shown(text)}; {measured:.6g} Hz found from the times")
    return measured


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _check_header(layout: ColumnLayout, n: int, source: Source) -> None:
    """Warn where the header and the data disagree; edited files often do."""
    header = layout.header
    count = header.get("Total Exported Frames", "")
    if count != str(n):
        source.warn(f"the header says {shown(count)} exported frames, the file has {n}")
    capture, export = (_number(header.get(f"{k} Frame Rate", "")) for k in ("Capture", "Export"))
    if export > capture * (1 + 1e-6):  # a lower rate leaves samples out, which does no harm
        source.warn(
            f"captured at {capture:g} Hz, exported at {export:g} Hz; samples are not independent"
        )
    space = header.get("Coordinate Space", "Global")
    if space.casefold() != "global":
        source.warn(f"coordinate space is {shown(space)}, not Global")
