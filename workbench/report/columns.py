"""Whole columns into a recording, with empty rows where nothing was seen."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

__all__ = ["TIMELINE", "send_seen"]

TIMELINE = "t"


def send_seen(
    stream: rr.RecordingStream,
    path: str,
    times: NDArray[np.float64],
    seen: NDArray[np.bool_],
    columns: rr.ComponentColumnList,
    each: int = 1,
) -> None:
    """Send a row for every time: the next of `columns` where seen, nothing elsewhere.

    An empty row makes the viewer show nothing; without it the last value would remain, and a
    curve would bridge the gap.

    Args:
        stream: the recording.
        path: the entity.
        times: (n,) [s].
        seen: (n,), with as many True as `columns` has rows.
        columns: what was seen, `each` values a sample.
        each: how many values belong to one sample.
    """
    if not len(times):
        return  # the viewer ends in a panic over an entity without rows
    rows = columns.partition(each * seen.astype(np.int64))
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=times)], rows)
