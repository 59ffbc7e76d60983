"""Read a row-format file row by row, with an error for the first row that cannot be used."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.row_table import (
    BODY_WORDS,
    LEAD,
    POINT_WIDTH,
    POSE_START,
    POSE_WIDTH,
    BodyRows,
    Head,
    RowTable,
    body_width,
    take_head_row,
    trimmed,
)
from workbench.tracking.source import Source, shown

__all__ = ["read_strict"]


@dataclass
class _Body:
    """Rows of one body so far."""

    name: str
    id: str
    markers: int | None = None
    frames: array[int] = field(default_factory=lambda: array("l"))
    lines: array[int] = field(default_factory=lambda: array("l"))
    lost: array[int] = field(default_factory=lambda: array("l"))
    values: array[float] = field(default_factory=lambda: array("d"))
    pose_frames: array[int] = field(default_factory=lambda: array("l"))
    poses: array[float] = field(default_factory=lambda: array("d"))


@dataclass
class _Rows:
    """Rows read so far."""

    version: str
    head: Head = field(default_factory=Head)
    lines: array[int] = field(default_factory=lambda: array("l"))
    indices: array[int] = field(default_factory=lambda: array("l"))
    times: array[float] = field(default_factory=lambda: array("d"))
    bodies: dict[str, _Body] = field(default_factory=dict)
    points: list[list[float]] = field(default_factory=list)
    labels: list[list[int]] = field(default_factory=list)
    vocabulary: dict[str, int] = field(default_factory=dict)
    surplus: int | None = None

    def body(self, identity: str, name: str) -> _Body:
        """Return the body of an id; the definition's name comes first, then the first row's."""
        if identity not in self.bodies:
            name = self.head.names.get(identity, name)
            self.bodies[identity] = _Body(name, identity, self.head.markers.get(identity))
        return self.bodies[identity]


def read_strict(source: Source, version: str) -> RowTable:
    """Read all rows.

    Raises:
        TakeError: a row cannot be used; the message names it and the cause.
    """
    rows = _Rows(version)
    for line, cells in trimmed(source):
        word = cells[0].strip().casefold()
        if word == "frame":
            _take_frame(rows, line, cells, source)
        elif word in BODY_WORDS and rows.indices:
            _take_body(rows, line, cells, source)
        else:
            take_head_row(rows.head, line, cells, source)
    if not rows.indices:
        raise source.fault(1, "there is no row 'frame'; the file has no data")
    for identity in rows.head.names:
        rows.body(identity, "")
    ordered = [*rows.head.names, *(i for i in rows.bodies if i not in rows.head.names)]
    points, labels = _points(rows, source)
    return RowTable(
        version=version,
        info=rows.head.info,
        indices=np.array(rows.indices, dtype=np.int64),
        times=_times(rows, source),
        bodies=tuple(_body_rows(rows.bodies[i], rows, source) for i in ordered),
        points=points,
        labels=labels,
        vocabulary=tuple(rows.vocabulary),
    )


def _take_frame(rows: _Rows, line: int, cells: list[str], source: Source) -> None:
    if len(cells) <= POSE_START:
        raise source.fault(line, f"the frame row is cut short: {len(cells)} cells; export it again")
    frame = len(rows.indices)
    rows.lines.append(line)
    rows.indices.append(source.count(cells[1], line, "the frame index", lowest=-(10**9)))
    rows.times.append(source.numbers(cells[2:3], line, (2,))[0])
    tracked = source.count(cells[3], line, "the count of tracked bodies")
    after = POSE_START + POSE_WIDTH * tracked
    if len(cells) <= after:
        raise source.fault(
            line, f"the frame row is cut short: {tracked} bodies need more than {len(cells)} cells"
        )
    for start in range(POSE_START, after, POSE_WIDTH):
        body = rows.body(cells[start].strip(), "")
        if body.pose_frames and body.pose_frames[-1] == frame:
            raise source.fault(line, f"the frame lists body {shown(body.id)} twice")
        body.pose_frames.append(frame)
        columns = range(start + 1, start + 8)
        body.poses.extend(source.numbers(cells[start + 1 : start + 8], line, columns))
    _take_points(rows, line, cells, after, source)


def _take_points(rows: _Rows, line: int, cells: list[str], at: int, source: Source) -> None:
    count = source.count(cells[at], line, "the count of visible markers")
    width, start = POINT_WIDTH[rows.version], at + 1
    found = len(cells) - start
    if found < width * count:
        raise source.fault(
            line,
            f"the frame row is cut short: {count} markers need {width * count} cells, "
            f"{found} follow",
        )
    surplus = found - width * count
    rows.surplus = surplus if rows.surplus is None else rows.surplus
    if surplus != rows.surplus:
        raise source.fault(
            line,
            f"the frame row has {surplus} cells after its {count} markers, the first frame row "
            f"{rows.surplus}",
        )
    if surplus:
        source.warn_once("frame rows have cells after their markers, ignored", line)
    columns = [start + i for i in range(width * count) if i % width < 3]
    rows.points.append(source.numbers([cells[i] for i in columns], line, columns))
    labels = cells[start + width - 1 : start + width * count : width]
    rows.labels.append([rows.vocabulary.setdefault(x, len(rows.vocabulary)) for x in labels])


def _take_body(rows: _Rows, line: int, cells: list[str], source: Source) -> None:
    if len(cells) <= LEAD:
        raise source.fault(line, f"the body row is cut short: {len(cells)} cells")
    frame, body = len(rows.indices) - 1, rows.body(cells[4].strip(), cells[3].strip())
    body.name = body.name or cells[3].strip()
    markers = source.count(cells[6], line, "the marker count")
    if not body.frames:
        body.markers = markers
    if markers != body.markers or len(cells) != body_width(markers, rows.version):
        expected = body.markers or 0
        raise source.fault(
            line,
            f"the row of {shown(body.name)} has {len(cells)} cells and {markers} markers; "
            f"{body_width(expected, rows.version)} cells and {expected} markers are expected",
        )
    if source.count(cells[1], line, "the frame index", lowest=-(10**9)) != rows.indices[frame]:
        source.warn_once("rows of bodies have another index than the frame above them", line)
    if body.frames and body.frames[-1] == frame:
        source.warn_once(f"{shown(body.name)} has several rows in a frame, the last counts", line)
    body.frames.append(frame)
    body.lines.append(line)
    body.lost.append(source.count(cells[5], line, "frames since last tracked"))
    body.values.extend(source.numbers(cells[LEAD:], line, range(LEAD, len(cells))))


def _times(rows: _Rows, source: Source) -> NDArray[np.float64]:
    times = source.checked(np.array(rows.times), rows.lines, "a time")
    blank = np.flatnonzero(np.isnan(times))
    if len(blank):
        raise source.fault(rows.lines[int(blank[0])], "the time of the frame is not a number")
    return times


def _body_rows(body: _Body, rows: _Rows, source: Source) -> BodyRows:
    name = f"body {shown(body.name)}"
    markers = body.markers or 0  # none where no row but a frame's names the body
    width = body_width(markers, rows.version) - LEAD
    values = np.array(body.values).reshape(len(body.frames), width)
    n = len(rows.indices)
    posed, poses = np.zeros(n, dtype=np.bool_), np.full((n, 7), np.nan)
    posed[body.pose_frames] = True
    poses[body.pose_frames] = np.reshape(body.poses, (-1, 7))
    return BodyRows(
        name=body.name,
        id=body.id,
        markers=markers,
        frames=np.array(body.frames, dtype=np.int64),
        lost=np.array(body.lost, dtype=np.int64),
        values=source.checked(values, body.lines, name),
        posed=posed,
        poses=source.checked(poses, rows.lines, name),
    )


def _points(rows: _Rows, source: Source) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    n, most = len(rows.points), max(map(len, rows.labels))
    points, labels = np.full((n, most, 3), np.nan), np.zeros((n, most), dtype=np.int32)
    for i, (row, names) in enumerate(zip(rows.points, rows.labels, strict=True)):
        points[i, : len(names)] = np.reshape(row, (-1, 3))
        labels[i, : len(names)] = names
    return source.checked(points, rows.lines, "a marker"), labels
