"""Read Motive's column format, versions 1.2 to 1.25."""

from __future__ import annotations

import numpy as np

from workbench.tracking.clock import jitter, motive_times, warn_of_index_steps
from workbench.tracking.motive_bodies import bodies_and_cloud
from workbench.tracking.motive_header import Layout, read_layout
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
    bodies, cloud = bodies_and_cloud(layout, table, rate, source)
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
    )


def _version(layout: Layout, source: Source) -> str:
    version = layout.header.get("Format Version", "")
    if version not in _VERSIONS:
        source.warn(f"format version {shown(version)} is not known; read like the nearest")
    return version


def _rate(layout: Layout, table: MotiveTable, source: Source) -> float:
    text = layout.header.get("Export Frame Rate", "")
    try:
        rate = float(text)
    except ValueError:
        rate = float("nan")
    if 0.1 <= rate <= 1e5:
        return rate
    if layout.time_column is not None:
        steps = np.diff(table.column(layout.time_column))
        steps = steps[steps > 0]
        if len(steps) and 1e-5 <= np.median(steps) <= 10:
            rate = 1.0 / float(np.median(steps))
            source.warn(f"Export Frame Rate is {shown(text)}; {rate:.6g} Hz told from the times")
            return rate
    raise source.fault(1, f"Export Frame Rate is {shown(text)} and the times give none")


def _check_header(layout: Layout, n: int, source: Source) -> None:
    """Warn where the header and the data disagree; edited files often do."""
    header = layout.header
    count = header.get("Total Exported Frames", "")
    if count != str(n):
        source.warn(f"the header says {shown(count)} exported frames, the file has {n}")
    capture, export = header.get("Capture Frame Rate", ""), header.get("Export Frame Rate", "")
    if capture and export and capture != export:
        source.warn(
            f"captured at {capture} Hz, exported at {export} Hz; samples are not independent"
        )
    space = header.get("Coordinate Space", "Global")
    if space.casefold() != "global":
        source.warn(f"coordinate space is {shown(space)}, not Global")
