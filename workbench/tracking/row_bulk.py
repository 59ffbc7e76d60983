"""Read a row-format file in bulk: rows of a kind that have the same cells form a rectangle."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.rectangle import Rectangle, Rows, find_rows, read_rectangle
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
    frame_width,
    take_head_row,
    trimmed,
)
from workbench.tracking.source import Source

__all__ = ["read_bulk"]

_COMMA = ord(",")


class _Declined(Exception):
    """A row needs a closer look than the bulk can give."""


class _Kind(NamedTuple):
    """Rows of the same kind and width.

    Args:
        rows: k rows.
        width: cells of each.
        places: (k,) where each goes in the result.
        frames: (k,) of each place.
    """

    rows: Rows
    width: int
    places: NDArray[np.int64]
    frames: NDArray[np.int64]


@dataclass
class _Frames:
    """What gathers from the frame rows, n in all; poses by id, points by kind of row."""

    indices: NDArray[np.float64]
    times: NDArray[np.float64]
    poses: dict[str, list[tuple[NDArray[np.int64], NDArray[np.float64]]]] = field(
        default_factory=dict
    )
    points: list[tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int32]]] = field(
        default_factory=list
    )
    vocabulary: dict[str, int] = field(default_factory=dict)


def read_bulk(source: Source, version: str) -> RowTable | None:
    """Read all rows at once, or return None where one of them needs a closer look."""
    try:
        return _read(source, version)
    except _Declined:
        return None


def _read(source: Source, version: str) -> RowTable:
    found = re.search(rb"\nframe,", source.data)
    if found is None:
        raise _Declined
    at = found.start() + 1
    head = _head(replace(source, data=source.data[:at]))
    lines = _Lines(source.data, at)
    frames = _Frames(np.empty(lines.n), np.empty(lines.n))
    for kind in lines.kinds(lines.is_frame):
        _take_frames(frames, kind, version, source)
    bodies: dict[str, BodyRows] = {}
    for kind in lines.kinds(lines.is_other):
        for rows in _bodies(head, frames, kind, version, source):
            _require(rows.id not in bodies)
            bodies[rows.id] = rows
    _require(frames.poses.keys() <= head.names.keys())
    points, labels = _points(frames)
    return RowTable(
        version=version,
        info=head.info,
        indices=frames.indices.astype(np.int64),
        times=frames.times,
        bodies=tuple(bodies.get(i) or _rowless(i, head, frames, version) for i in head.names),
        points=points,
        labels=labels,
        vocabulary=tuple(frames.vocabulary),
    )


def _require(plain: bool | np.bool_) -> None:
    if not plain:
        raise _Declined


def _head(source: Source) -> Head:
    """Read what stands before the first frame; no cell of it may reach into the frames."""
    text = source.text() + "frame"
    rows = list(csv.reader(io.StringIO(text, newline="")))
    _require(len(rows) == text.count("\n") + 1 and rows[-1] == ["frame"])
    head = Head()
    for line, cells in trimmed(source):
        _require(cells[0].strip().casefold() != "frame")
        take_head_row(head, line, cells, source)
    return head


class _Lines:
    """The lines from the first frame on.

    Args:
        data: the file's bytes.
        at: where the first frame starts.
    """

    def __init__(self, data: bytes | memoryview, at: int) -> None:
        self._rows = rows = find_rows(data, at)
        self._width = rows.widths()
        given = self._width > 0
        # spreadsheets add blank cells at the end of a line, and lost cells leave them
        _require(not (rows.text[rows.ends[given] - 1] == _COMMA).any())
        self.is_frame = rows.text[rows.begins] == ord("f")
        self.is_other = ~self.is_frame & given
        self._frame = np.cumsum(self.is_frame) - 1
        self._after_frame = np.arange(len(rows)) - np.flatnonzero(self.is_frame)[self._frame]
        self.n = int(self._frame[-1]) + 1

    def kinds(self, mask: NDArray[np.bool_]) -> Iterator[_Kind]:
        """Yield the lines of a mask, those of the same width together.

        Lines that follow their frames alike are neighbours: mostly they are of one body.
        """
        for width in np.flatnonzero(np.bincount(self._width[mask])).tolist():
            members = np.flatnonzero(mask & (self._width == width))
            order = np.argsort(self._after_frame[members], kind="stable")
            places = np.empty_like(order)
            places[order] = np.arange(len(order))
            yield _Kind(self._rows.of(members), width, places, self._frame[members[order]])


def _read_kind(kind: _Kind, numbers: list[int], words: list[int], source: Source) -> Rectangle:
    found = read_rectangle(
        kind.rows, kind.width, numbers, words, source.plain_encoding, kind.places
    )
    if found is None:
        raise _Declined
    _require("" not in found.vocabulary)
    return found


def _take_frames(frames: _Frames, kind: _Kind, version: str, source: Source) -> None:
    """Read frame rows that list the same number of bodies and of points."""
    tracked, seen = _counts(kind.rows)
    _require(kind.width == frame_width(tracked, seen, version))
    poses = [POSE_START + POSE_WIDTH * j for j in range(tracked)]
    count = POSE_START + POSE_WIDTH * tracked
    points = [count + 1 + POINT_WIDTH[version] * k for k in range(seen)]
    numbers = [1, 2, 3, count]
    numbers += [start + 1 + i for start in poses for i in range(7)]
    numbers += [start + i for start in points for i in range(3)]
    words = [0, *poses, *(start + POINT_WIDTH[version] - 1 for start in points)]
    found = _read_kind(kind, numbers, words, source)
    _require(found.words(0).keys() == {"frame"})
    index, time, bodies, visible = found.numbers[:4]
    _require((index == np.round(index)).all() and np.isfinite(time).all())
    _require((bodies == tracked).all() and (visible == seen).all())
    frames.indices[kind.frames], frames.times[kind.frames] = index, time
    for j in range(tracked):
        values = found.numbers[4 + 7 * j : 11 + 7 * j]
        for identity, of in found.words(1 + j).items():
            pose = (kind.frames[of], np.take(values, of, axis=1).T)
            frames.poses.setdefault(identity.strip(), []).append(pose)
    # of a frame that shows nothing there are no numbers, so the count of rows has to be stated
    places = found.numbers[4 + 7 * tracked :].reshape(seen, 3, len(kind.frames)).transpose(2, 0, 1)
    codes = found.codes[1 + tracked :]
    known = np.zeros(len(found.vocabulary), dtype=np.int32)
    for code in np.flatnonzero(np.bincount(codes.ravel())):
        known[code] = frames.vocabulary.setdefault(found.vocabulary[code], len(frames.vocabulary))
    frames.points.append((kind.frames, places, known[codes].T))


def _counts(rows: Rows) -> tuple[int, int]:
    """Return the counts of tracked bodies and of visible points in the first of some rows."""
    cells = rows.text[rows.begins[0] : rows.ends[0]].tobytes().split(b",")
    try:
        tracked = int(cells[3])
        return tracked, int(cells[POSE_START + POSE_WIDTH * tracked])
    except (IndexError, ValueError):
        raise _Declined from None


def _bodies(
    head: Head, frames: _Frames, kind: _Kind, version: str, source: Source
) -> Iterator[BodyRows]:
    """Yield the bodies whose rows are that wide."""
    _require(kind.width > LEAD)
    numbers = [1, 5, 6, *range(LEAD, kind.width)]
    found = _read_kind(kind, numbers, [0, 3, 4], source)
    index, lost, markers = found.numbers[:3]
    _require(found.words(0).keys() <= set(BODY_WORDS))
    _require((index == frames.indices[kind.frames]).all())
    _require((lost == np.round(lost)).all() and (lost >= 0).all())
    _require(markers[0] >= 0 and (markers == markers[0]).all())
    _require(body_width(int(markers[0]), version) == kind.width)
    for text, of in found.words(2).items():
        of = of[np.argsort(kind.frames[of], kind="stable")]
        identity, own = text.strip(), kind.frames[of]
        some = slice(of[0], of[-1] + 1) if (np.diff(of) == 1).all() else of
        _require(head.names.get(identity, "") != "" and (np.diff(own) > 0).all())
        pose_frames, poses = _poses(identity, frames)
        yield BodyRows(
            name=head.names[identity],
            id=identity,
            markers=int(markers[0]),
            frames=own,
            lost=lost[of].astype(np.int64),
            values=found.numbers[3:, some].T,
            pose_frames=pose_frames,
            poses=poses,
        )


def _poses(identity: str, frames: _Frames) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return a body's poses in the order of the frames."""
    pieces = frames.poses.get(identity, [])
    if not pieces:
        return np.empty(0, dtype=np.int64), np.empty((0, 7))
    of = np.concatenate([piece[0] for piece in pieces])
    order = np.argsort(of, kind="stable")
    _require((np.diff(of[order]) > 0).all())
    return of[order], np.concatenate([piece[1] for piece in pieces])[order]


def _rowless(identity: str, head: Head, frames: _Frames, version: str) -> BodyRows:
    """Return a body that is defined, but has no rows of its own."""
    markers = head.markers[identity]
    none = np.empty(0, dtype=np.int64)
    values = np.empty((0, body_width(markers, version) - LEAD))
    pose_frames, poses = _poses(identity, frames)
    return BodyRows(head.names[identity], identity, markers, none, none, values, pose_frames, poses)


def _points(frames: _Frames) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    n, most = len(frames.indices), max(labels.shape[1] for _, _, labels in frames.points)
    points = np.empty((most, 3, n)).transpose(2, 0, 1)  # frames along the fast axis
    names = np.zeros((n, most), dtype=np.int32)
    for of, places, labels in frames.points:
        count = labels.shape[1]
        points[of, :count], points[of, count:], names[of, :count] = places, np.nan, labels
    return points, names
