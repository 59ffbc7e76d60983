"""Read a row-format file in bulk: rows of a kind that have the same cells form a rectangle."""

from __future__ import annotations

import csv
import io
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.csv_columns import ABSENT, CsvColumns, Rows, find_rows, read_columns
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

_FRAME, _COMMA = b"f,"


class _Declined(Exception):
    """A row is unusual and must be read by `read_strict`."""


class _Kind(NamedTuple):
    """Rows of the same kind and width.

    Args:
        rows: k rows.
        width: cells of each.
        frames: (k,) of each row.
        after: (k,) number of rows from its frame's row to each.
    """

    rows: Rows
    width: int
    frames: NDArray[np.int64]
    after: NDArray[np.int64]


_Poses = tuple[NDArray[np.bool_], NDArray[np.float64]]


class _Frames(NamedTuple):
    """Content of the n frame rows.

    Args:
        indices: (n,).
        times: (n,) [s].
        poses: by id (n,) True where a frame lists the body, and (n, 7) its poses, else NaN.
        points: (n, k, 3) NaN where there is none.
        labels: (n, k) indices into the vocabulary.
        vocabulary: the different words.
    """

    indices: NDArray[np.float64]
    times: NDArray[np.float64]
    poses: dict[str, _Poses]
    points: NDArray[np.float64]
    labels: NDArray[np.int32]
    vocabulary: tuple[str, ...]

    def poses_of(self, identity: str) -> _Poses:
        """Return the poses of a body, also of one that no frame lists."""
        n = len(self.indices)
        return self.poses.get(identity) or (np.zeros(n, dtype=np.bool_), np.full((n, 7), np.nan))


def read_bulk(source: Source, version: str) -> RowTable | None:
    """Read all rows at once, or return None where one of them is unusual."""
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
    frames = _frames(lines, version, source)
    bodies: dict[str, BodyRows] = {}
    for kind in lines.kinds(lines.is_other):
        for rows in _bodies(head, frames, kind, version, source):
            _require(rows.id not in bodies)
            bodies[rows.id] = rows
    _require(frames.poses.keys() <= head.names.keys())
    return RowTable(
        version=version,
        info=head.info,
        indices=frames.indices.astype(np.int64),
        times=frames.times,
        bodies=tuple(bodies.get(i) or _rowless(i, head, frames, version) for i in head.names),
        points=frames.points,
        labels=frames.labels,
        vocabulary=frames.vocabulary,
    )


def _require(plain: bool | np.bool_) -> None:
    if not plain:
        raise _Declined


def _head(source: Source) -> Head:
    """Read the head before the first frame; no cell of it may extend into the frames."""
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
        at: byte of the first frame.
    """

    def __init__(self, data: bytes | memoryview, at: int) -> None:
        self._rows = rows = find_rows(data, at)
        self._width, (first, last) = rows.counted()
        # spreadsheets add blank cells at the end of a line, and lost cells leave them
        _require(not (last == _COMMA).any())
        self.is_frame = first == _FRAME
        self.is_other = ~self.is_frame & (self._width > 0)
        self._frame = np.cumsum(self.is_frame) - 1
        self._after_frame = np.arange(len(rows)) - np.flatnonzero(self.is_frame)[self._frame]
        self.n = int(self._frame[-1]) + 1

    def kinds(self, mask: NDArray[np.bool_]) -> Iterator[_Kind]:
        """Yield the lines of a mask, those of the same width together."""
        for width in np.flatnonzero(np.bincount(self._width[mask])).tolist():
            members = np.flatnonzero(mask & (self._width == width))
            frames, after = self._frame[members], self._after_frame[members]
            yield _Kind(self._rows.of(members), width, frames, after)


def _frames(lines: _Lines, version: str, source: Source) -> _Frames:
    """Read the frame rows; those of a kind list the same number of bodies and of points."""
    kinds = list(lines.kinds(lines.is_frame))
    counts = [_counts(kind, version) for kind in kinds]
    bodies, points = (max(each) for each in zip(*counts, strict=True))
    found = CsvColumns.empty(4 + 7 * bodies + 3 * points, 1 + bodies + points, lines.n)
    last = POINT_WIDTH[version] - 1
    for kind, (tracked, seen) in zip(kinds, counts, strict=True):
        count = POSE_START + POSE_WIDTH * tracked
        poses = [POSE_START + POSE_WIDTH * j if j < tracked else None for j in range(bodies)]
        each = [count + 1 + (last + 1) * k if k < seen else None for k in range(points)]
        numbers = [1, 2, 3, count, *_cells(poses, range(1, 8)), *_cells(each, range(3))]
        words = [0, *_cells(poses, [0]), *_cells(each, [last])]
        _read_kind(kind, numbers, words, source, kind.frames, found)
        stated = found.numbers[2:4, kind.frames]
        _require((stated[0] == tracked).all() and (stated[1] == seen).all())
    index, time = found.numbers[:2]
    _require(found.words(0).keys() == {"frame"})
    _require((index == np.round(index)).all() and np.isfinite(time).all())
    return _Frames(
        indices=index,
        times=time,
        poses=_poses(found, bodies),
        # of frames that show nothing there are no numbers, so the count has to be stated
        points=found.numbers[4 + 7 * bodies :].reshape(points, 3, lines.n).transpose(2, 0, 1),
        labels=found.codes[1 + bodies :].T,
        vocabulary=tuple(found.vocabulary),
    )


def _read_kind(
    kind: _Kind,
    numbers: list[int],
    words: list[int],
    source: Source,
    places: NDArray[np.int64],
    found: CsvColumns | None = None,
) -> CsvColumns:
    encoding = source.plain_encoding
    found = read_columns(kind.rows, kind.width, numbers, words, encoding, places, found)
    if found is None:
        raise _Declined
    _require("" not in found.vocabulary)
    return found


def _cells(starts: Sequence[int | None], offsets: Sequence[int]) -> list[int]:
    """Return the cells at some offsets from where groups of them start, in rows that have them."""
    return [ABSENT if start is None else start + i for start in starts for i in offsets]


def _counts(kind: _Kind, version: str) -> tuple[int, int]:
    """Return the counts of tracked bodies and of visible points in the first of some frame rows."""
    rows = kind.rows
    cells = rows.text[rows.begins[0] : rows.ends[0]].tobytes().split(b",")
    try:
        tracked = int(cells[3])
        seen = int(cells[POSE_START + POSE_WIDTH * tracked])
    except (IndexError, ValueError):
        raise _Declined from None
    _require(min(tracked, seen) >= 0 and kind.width == frame_width(tracked, seen, version))
    return tracked, seen


def _bodies(
    head: Head, frames: _Frames, kind: _Kind, version: str, source: Source
) -> Iterator[BodyRows]:
    """Yield the bodies whose rows are that wide."""
    _require(kind.width > LEAD)
    numbers = [1, 5, 6, *range(LEAD, kind.width)]
    # lines that follow their frames alike become neighbours: mostly they are of one body
    order = np.argsort(np.minimum(kind.after, 255).astype(np.uint8), kind="stable")
    places = np.empty_like(order)
    places[order] = np.arange(len(order))
    found = _read_kind(kind, numbers, [0, 3, 4], source, places)
    frame_of = kind.frames[order]
    index, lost, markers = found.numbers[:3]
    _require(found.words(0).keys() <= set(BODY_WORDS))
    _require((index == frames.indices[frame_of]).all())
    _require((lost == np.round(lost)).all() and (lost >= 0).all())
    _require(markers[0] >= 0 and (markers == markers[0]).all())
    _require(body_width(int(markers[0]), version) == kind.width)
    for text, of in found.words(2).items():
        of = of[np.argsort(frame_of[of], kind="stable")]
        identity, own = text.strip(), frame_of[of]
        some = slice(of[0], of[-1] + 1) if (np.diff(of) == 1).all() else of
        _require(head.names.get(identity, "") != "" and (np.diff(own) > 0).all())
        posed, poses = frames.poses_of(identity)
        yield BodyRows(
            name=head.names[identity],
            id=identity,
            markers=int(markers[0]),
            frames=own,
            lost=lost[of].astype(np.int64),
            values=found.numbers[3:, some].T,
            posed=posed,
            poses=poses,
        )


def _poses(found: CsvColumns, bodies: int) -> dict[str, _Poses]:
    """Return by id where frames list a body, and its poses; the first columns of words are ids."""
    ids, here = slice(1, 1 + bodies), defaultdict[str, Any](bool)
    for text, code in found.used(ids).items():
        here[text.strip()] |= found.codes[ids] == code
    n = found.numbers.shape[1]
    places, poses = found.numbers[4 : 4 + 7 * bodies].reshape(bodies, 7, n), {}
    for identity, where in here.items():
        pose = np.full((7, n), np.nan)
        for own, values in zip(where, places, strict=True):
            pose = np.where(own, values, pose) if own.any() else pose
        listed = where.any(axis=0)
        _require(np.count_nonzero(where) == np.count_nonzero(listed))
        poses[identity] = listed, pose.T
    return poses


def _rowless(identity: str, head: Head, frames: _Frames, version: str) -> BodyRows:
    """Return a body that is defined, but has no rows of its own."""
    markers = head.markers[identity]
    none = np.empty(0, dtype=np.int64)
    values = np.empty((0, body_width(markers, version) - LEAD))
    posed, poses = frames.poses_of(identity)
    return BodyRows(head.names[identity], identity, markers, none, none, values, posed, poses)
