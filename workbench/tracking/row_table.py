"""The content of a row-format file: tables of numbers, one a kind of row, and the head.

Rows are ragged: a frame lists only the bodies it tracks and the points it sees. A row `trackable`
or `rigidbody` defines a body before the first frame and reports on it after.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.source import Source, shown

__all__ = [
    "BODY_WORDS",
    "LEAD",
    "MODEL_WIDTH",
    "POINT_WIDTH",
    "POSE_START",
    "POSE_WIDTH",
    "BodyRows",
    "Head",
    "RowTable",
    "body_width",
    "frame_width",
    "take_head_row",
    "trimmed",
    "version_of",
]

BODY_WORDS = ("trackable", "rigidbody")
MODEL_WIDTH = {"1.0": 3, "1.1": 4}
"""Cells of a model marker: x, y, z and in 1.1 an id."""
POINT_WIDTH = {"1.0": 4, "1.1": 5}
"""Cells of a visible point: x, y, z, id and in 1.1 a name."""
POSE_START = 4
"""Cells of a frame row before its poses: word, index, time, count of tracked bodies."""
POSE_WIDTH = 11
"""Cells of a pose: id, x, y, z, qx, qy, qz, qw, yaw, pitch, roll."""
LEAD = 7
"""Cells of a body row before its markers: word, index, time, name, id, lost counter, count."""


@dataclass(frozen=True, eq=False)
class BodyRows:
    """The rows of one body.

    Args:
        name: of the body, empty where frame rows alone name its id.
        id: of the body.
        markers: m, how many it has.
        frames: (k,) the frame that each row belongs to, as an index into `RowTable.indices`.
        lost: (k,) frames since it was last tracked.
        values: (k, w m + 5 m + 1) cells after the marker count, w = `MODEL_WIDTH` [unit of each
            cell].
        posed: (n,) True where a frame lists its pose.
        poses: (n, 7) x, y, z [m], qx, qy, qz, qw [1], NaN in other frames.
    """

    name: str
    id: str
    markers: int
    frames: NDArray[np.int64]
    lost: NDArray[np.int64]
    values: NDArray[np.float64]
    posed: NDArray[np.bool_]
    poses: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RowTable:
    """All rows.

    Args:
        version: "1.0" or "1.1".
        info: keys and texts of the rows `info`.
        indices: (n,) of the frames.
        times: (n,) of the frames [s].
        bodies: in the order of their definitions.
        points: (n, k, 3) the visible points of each frame, NaN where there is none [m].
        labels: (n, k) names of the points as indices into `vocabulary`.
        vocabulary: the different names.
    """

    version: str
    info: dict[str, str]
    indices: NDArray[np.int64]
    times: NDArray[np.float64]
    bodies: tuple[BodyRows, ...]
    points: NDArray[np.float64]
    labels: NDArray[np.int32]
    vocabulary: tuple[str, ...]


def body_width(markers: int, version: str) -> int:
    """Return the cells of a body row."""
    return LEAD + (MODEL_WIDTH[version] + 5) * markers + 1


def frame_width(bodies: int, points: int, version: str) -> int:
    """Return the cells of a frame row."""
    return POSE_START + POSE_WIDTH * bodies + 1 + POINT_WIDTH[version] * points


@dataclass
class Head:
    """The head before the first frame: keys and texts; name and marker count of each id."""

    info: dict[str, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    markers: dict[str, int] = field(default_factory=dict)


def take_head_row(head: Head, line: int, cells: list[str], source: Source) -> None:
    """Read one row of the head."""
    word = cells[0].strip().casefold()
    if word in BODY_WORDS:
        if len(cells) < 4:
            raise source.fault(line, f"the definition of a body is cut short: {len(cells)} cells")
        identity, name = cells[2].strip(), cells[1].strip()
        if identity in head.names:
            raise source.fault(
                line, f"id {shown(identity)} belongs to {shown(head.names[identity])} already"
            )
        head.markers[identity] = source.count(cells[3], line, "the marker count")
        head.names[identity] = name
    elif word == "info" and len(cells) > 2:
        head.info[cells[1].strip()] = cells[2].strip()
    elif word == "lefthanded":
        source.warn("the file is left-handed; the motion is mirrored unless the axes allow for it")
    elif word not in ("comment", "righthanded", "info"):
        raise source.fault(line, f"a row starts with {shown(cells[0])}; no row format has that")


def trimmed(source: Source) -> Iterator[tuple[int, list[str]]]:
    """Yield rows without the trailing commas that a spreadsheet adds; no cell is blank here."""
    for line, cells in source.rows():
        while not cells[-1]:
            cells.pop()
        yield line, cells


def version_of(source: Source) -> str:
    """Return the version by the width of the first rows; `info` may be absent or rewritten.

    Raises:
        TakeError: neither the rows nor `info` give a known version.
    """
    stated, in_frames = "1.0", False
    for line, cells in trimmed(source):
        word = cells[0].strip().casefold()
        if word == "info" and len(cells) > 2 and cells[1].strip() == "version":
            stated = {"1": "1.0"}.get(cells[2].strip(), cells[2].strip())
        fits: list[str] = []
        if word == "frame":
            in_frames, fits = True, _versions_of_frame(cells)
        elif in_frames and word in BODY_WORDS and len(cells) >= LEAD:
            markers = source.count(cells[6], line, "the marker count")
            fits = [v for v in MODEL_WIDTH if body_width(markers, v) == len(cells)]
        if len(fits) == 1:
            if stated not in fits:
                source.warn(f"the file says version {shown(stated)}, its rows are of {fits[0]}")
            return fits[0]
    if stated not in MODEL_WIDTH:
        raise source.fault(1, f"row format version {shown(stated)} is not known; 1.0 and 1.1 are")
    return stated


def _versions_of_frame(cells: list[str]) -> list[str]:
    """Return the versions whose frame rows with points are that wide."""
    try:
        bodies = int(cells[3])
        points = int(cells[POSE_START + POSE_WIDTH * bodies])
    except (IndexError, ValueError):
        return []
    return [v for v in POINT_WIDTH if points > 0 and frame_width(bodies, points, v) == len(cells)]
