"""Read a row-format file in bulk: rows of a kind that have the same cells form a rectangle."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.pieces import Pieces
from workbench.tracking.rectangle import Rectangle, read_rectangle
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

_BLOCK = 4096  # lines whose commas are counted at a time, so that they stay in the cache
_CHUNK = 1 << 20  # bytes searched for newlines at a time, for the same reason
_NEWLINE, _RETURN, _COMMA = b"\n\r,"


class _Declined(Exception):
    """A row needs a closer look than the bulk can give."""


class _Kind(NamedTuple):
    """Rows of the same kind and width: their text, cells a row, and the frame of each (k,)."""

    text: Pieces
    width: int
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
    at = source.data.find(b"\nframe,") + 1
    _require(at > 0)
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

    def __init__(self, data: bytes, at: int) -> None:
        self._data = data
        buffer = np.frombuffer(data, np.uint8)
        stops = _newlines(buffer, at)
        self._starts = np.concatenate(([at], stops[:-1]))
        self._stops, first = stops, buffer[self._starts]
        blank = (first == _NEWLINE) | (first == _RETURN)
        _require(not _ends_in_comma(buffer, stops)[~blank].any())
        self._width = _commas(buffer, self._starts, stops) + 1
        self.is_frame = first == ord("f")
        self.is_other = ~self.is_frame & ~blank
        self._frame = np.cumsum(self.is_frame) - 1
        self.n = int(self._frame[-1]) + 1

    def kinds(self, mask: NDArray[np.bool_]) -> Iterator[_Kind]:
        """Yield the lines of a mask, those of the same width together."""
        for width in np.flatnonzero(np.bincount(self._width[mask])).tolist():
            members = mask & (self._width == width)
            edges = np.flatnonzero(np.diff(members, prepend=False, append=False))
            begins, ends = self._starts[edges[::2]], self._stops[edges[1::2] - 1]
            yield _Kind(Pieces(self._data, begins, ends), width, self._frame[members])


def _newlines(buffer: NDArray[np.uint8], at: int) -> NDArray[np.int64]:
    """Return where each line from `at` on stops, one past its newline."""
    found = [
        np.flatnonzero(buffer[start : start + _CHUNK] == _NEWLINE) + (start + 1)
        for start in range(at, len(buffer), _CHUNK)
    ]
    stops = np.concatenate(found)
    return stops if len(stops) and stops[-1] == len(buffer) else np.append(stops, len(buffer))


def _ends_in_comma(buffer: NDArray[np.uint8], stops: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell lines whose last cell is blank; spreadsheets add such, and lost cells leave them."""
    last = stops - 1
    for end in (_NEWLINE, _RETURN):
        last = last - (buffer[last] == end)
    return buffer[last] == _COMMA


def _commas(
    buffer: NDArray[np.uint8], starts: NDArray[np.int64], stops: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the number of commas in each line."""
    count = np.empty(len(starts), dtype=np.int64)
    for i in range(0, len(starts), _BLOCK):
        own = slice(i, i + _BLOCK)
        is_comma = buffer[starts[i] : stops[own][-1]] == _COMMA
        count[own] = np.add.reduceat(
            is_comma.view(np.uint8), starts[own] - starts[i], dtype=np.int32
        )
    return count


def _read_kind(kind: _Kind, numbers: list[int], words: list[int], source: Source) -> Rectangle:
    found = read_rectangle(kind.text, kind.width, numbers, words, source.plain_encoding)
    if found is None:
        raise _Declined
    _require(found.numbers.shape[1] == len(kind.frames))
    _require(all("" not in texts.vocabulary for texts in found.words))
    return found


def _take_frames(frames: _Frames, kind: _Kind, version: str, source: Source) -> None:
    """Read frame rows that list the same number of bodies and of points."""
    tracked, seen = _counts(kind.text.first_row())
    _require(kind.width == frame_width(tracked, seen, version))
    poses = [POSE_START + POSE_WIDTH * j for j in range(tracked)]
    count = POSE_START + POSE_WIDTH * tracked
    points = [count + 1 + POINT_WIDTH[version] * k for k in range(seen)]
    numbers = [1, 2, 3, count]
    numbers += [start + 1 + i for start in poses for i in range(7)]
    numbers += [start + i for start in points for i in range(3)]
    words = [0, *poses, *(start + POINT_WIDTH[version] - 1 for start in points)]
    found = _read_kind(kind, numbers, words, source)
    _require(set(found.words[0].vocabulary) == {"frame"})
    index, time, bodies, visible = found.numbers[:4]
    _require((index == np.round(index)).all() and np.isfinite(time).all())
    _require((bodies == tracked).all() and (visible == seen).all())
    frames.indices[kind.frames], frames.times[kind.frames] = index, time
    for j, ids in enumerate(found.words[1 : 1 + tracked]):
        values = found.numbers[4 + 7 * j : 11 + 7 * j]
        for code, identity in enumerate(ids.vocabulary):
            of = np.flatnonzero(ids.codes == code)
            pose = (kind.frames[of], np.take(values, of, axis=1).T)
            frames.poses.setdefault(identity.strip(), []).append(pose)
    # of a frame that shows nothing there are no numbers, so the count of rows has to be stated
    places = found.numbers[4 + 7 * tracked :].reshape(seen, 3, len(kind.frames)).transpose(2, 0, 1)
    labels = np.empty(places.shape[:2], dtype=np.int32)
    for k, texts in enumerate(found.words[1 + tracked :]):
        known = [frames.vocabulary.setdefault(x, len(frames.vocabulary)) for x in texts.vocabulary]
        labels[:, k] = np.array(known, dtype=np.int32)[texts.codes]
    frames.points.append((kind.frames, places, labels))


def _counts(row: bytes) -> tuple[int, int]:
    """Return the counts of tracked bodies and of visible points in a row."""
    cells = row.split(b",")
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
    words, _, ids = found.words
    index, lost, markers = found.numbers[:3]
    _require(set(words.vocabulary) <= set(BODY_WORDS))
    _require((index == frames.indices[kind.frames]).all())
    _require((lost == np.round(lost)).all() and (lost >= 0).all())
    _require(markers[0] >= 0 and (markers == markers[0]).all())
    _require(body_width(int(markers[0]), version) == kind.width)
    for code, text in enumerate(ids.vocabulary):
        of, identity = np.flatnonzero(ids.codes == code), text.strip()
        own = kind.frames[of]
        _require(head.names.get(identity, "") != "" and (np.diff(own) > 0).all())
        pose_frames, poses = _poses(identity, frames)
        yield BodyRows(
            name=head.names[identity],
            id=identity,
            markers=int(markers[0]),
            frames=own,
            lost=lost[of].astype(np.int64),
            values=np.take(found.numbers[3:], of, axis=1).T,
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
    points, names = np.full((n, most, 3), np.nan), np.zeros((n, most), dtype=np.int32)
    for of, places, labels in frames.points:
        points[of, : labels.shape[1]] = places
        names[of, : labels.shape[1]] = labels
    return points, names
