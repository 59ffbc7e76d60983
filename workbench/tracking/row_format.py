"""Read the row formats 1.0 and 1.1 of Tracking Tools: the first cell names what a row holds.

A row `trackable` or `rigidbody` defines a body before the first frame and reports on it after. Rows
are ragged: a frame lists only the bodies it tracks and the points it sees.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.clock import jitter, row_rate, warn_of_index_steps
from workbench.tracking.rotations import usable
from workbench.tracking.source import Source, shown, unique_name
from workbench.tracking.take import BodyTake, Cloud, Missing, Take, known

__all__ = ["parse_row"]

_BODY_WORDS = ("trackable", "rigidbody")
_MODEL_WIDTH = {"1.0": 3, "1.1": 4}  # x, y, z and in 1.1 an id
_POINT_WIDTH = {"1.0": 4, "1.1": 5}  # x, y, z, id and in 1.1 a name
_POSE_WIDTH = 11  # id, x, y, z, qx, qy, qz, qw, yaw, pitch, roll
_QUATERNION_WXYZ = [7, 4, 5, 6]
_LEAD = 7  # cells of a body row before its markers


@dataclass
class _BodyRows:
    """What gathers for one body while the file is read."""

    name: str
    id: str
    markers: int | None = None
    frames: array[int] = field(default_factory=lambda: array("l"))
    lines: array[int] = field(default_factory=lambda: array("l"))
    lost: list[int] = field(default_factory=list)
    values: array[float] = field(default_factory=lambda: array("d"))
    pose_frames: array[int] = field(default_factory=lambda: array("l"))
    poses: array[float] = field(default_factory=lambda: array("d"))


@dataclass
class _File:
    """What gathers while the rows are read."""

    version: str
    info: dict[str, str] = field(default_factory=dict)
    lines: array[int] = field(default_factory=lambda: array("l"))
    indices: array[int] = field(default_factory=lambda: array("l"))
    times: array[float] = field(default_factory=lambda: array("d"))
    bodies: dict[str, _BodyRows] = field(default_factory=dict)
    points: list[list[float]] = field(default_factory=list)
    point_names: list[list[str]] = field(default_factory=list)
    overlong: bool = False


def parse_row(source: Source) -> Take:
    """Turn the text of a row-format export into a take.

    Raises:
        TakeError: the file cannot be used; the message names file, line and cause.
    """
    file = _File(_version(source))
    for line, cells in _trimmed(source):
        _take_row(file, line, cells, source)
    _check(file, source)
    indices = np.array(file.indices, dtype=np.int64)
    times = _times(file, source)
    warn_of_index_steps(indices, source)
    bodies: dict[str, BodyTake] = {}
    for rows in file.bodies.values():
        name = unique_name(rows.name, list(bodies), source)
        bodies[name] = _body(rows, name, len(indices), file.version, source)
    return Take(
        path=source.path,
        sha256=source.sha256,
        format="row",
        version=file.version,
        rate_hz=row_rate(times, source),
        jitter_s=jitter(indices, times),
        indices=indices,
        times=times,
        bodies=bodies,
        cloud=_cloud(file, list(bodies.values()), source),
        header=file.info,
        warnings=tuple(source.warnings),
    )


def _times(file: _File, source: Source) -> NDArray[np.float64]:
    times = source.checked(np.array(file.times), file.lines, "a time")
    blank = np.flatnonzero(np.isnan(times))
    if len(blank):
        raise source.fault(file.lines[int(blank[0])], "the time of the frame is not a number")
    return times


def _trimmed(source: Source) -> Iterator[tuple[int, list[str]]]:
    """Yield rows without the trailing commas that a spreadsheet adds; no cell is blank here."""
    for line, cells in source.rows():
        while not cells[-1]:
            cells.pop()
        yield line, cells


def _version(source: Source) -> str:
    """Tell the version from the width of the first body row; `info` may be absent or rewritten."""
    told, framed = "1.0", False
    for line, cells in _trimmed(source):
        word = cells[0].strip().casefold()
        if word == "info" and len(cells) > 2 and cells[1].strip() == "version":
            told = {"1": "1.0"}.get(cells[2].strip(), cells[2].strip())
        framed = framed or word == "frame"
        if framed and word in _BODY_WORDS and len(cells) >= _LEAD:
            markers = source.count(cells[6], line, "the marker count")
            fits = [v for v in _MODEL_WIDTH if _width(markers, v) == len(cells)]
            if fits and told not in fits:
                source.warn(f"the file says version {shown(told)}, its rows are of {fits[0]}")
                return fits[0]
            break
    if told not in _MODEL_WIDTH:
        raise source.fault(1, f"row format version {shown(told)} is not known; 1.0 and 1.1 are")
    return told


def _width(markers: int, version: str) -> int:
    return _LEAD + (_MODEL_WIDTH[version] + 5) * markers + 1


def _take_row(file: _File, line: int, cells: list[str], source: Source) -> None:
    word = cells[0].strip().casefold()
    if word == "frame":
        _take_frame(file, line, cells, source)
    elif word in _BODY_WORDS:
        if file.indices:
            _take_body(file, line, cells, source)
        else:
            _take_definition(file, line, cells, source)
    elif word == "info" and len(cells) > 2:
        file.info[cells[1].strip()] = cells[2].strip()
    elif word == "lefthanded":
        source.warn("the file is left-handed; the motion is mirrored unless the axes allow for it")
    elif word not in ("comment", "righthanded", "info"):
        raise source.fault(line, f"a row starts with {shown(cells[0])}; no row format has that")


def _take_definition(file: _File, line: int, cells: list[str], source: Source) -> None:
    if len(cells) < 4:
        raise source.fault(line, f"the definition of a body is cut short: {len(cells)} cells")
    identity = cells[2].strip()
    file.bodies[identity] = _BodyRows(
        cells[1].strip(), identity, source.count(cells[3], line, "the marker count")
    )


def _take_frame(file: _File, line: int, cells: list[str], source: Source) -> None:
    if len(cells) < 5:
        raise source.fault(line, f"the frame row is cut short: {len(cells)} cells")
    frame = len(file.indices)
    file.lines.append(line)
    file.indices.append(source.count(cells[1], line, "the frame index", lowest=-(10**9)))
    file.times.append(source.numbers(cells[2:3], line, 3)[0])
    tracked = source.count(cells[3], line, "the count of tracked bodies")
    after = 4 + _POSE_WIDTH * tracked
    if len(cells) <= after:
        raise source.fault(
            line, f"the frame row is cut short: {tracked} bodies need more than {len(cells)} cells"
        )
    for start in range(4, after, _POSE_WIDTH):
        identity = cells[start].strip()
        body = file.bodies.setdefault(identity, _BodyRows(f"body {identity}", identity))
        body.pose_frames.append(frame)
        body.poses.extend(source.numbers(cells[start + 1 : start + 8], line, start + 2))
    _take_points(file, line, cells, after, source)


def _take_points(file: _File, line: int, cells: list[str], at: int, source: Source) -> None:
    count = source.count(cells[at], line, "the count of visible markers")
    width, cells, start = _POINT_WIDTH[file.version], cells[at + 1 :], at + 2
    if len(cells) < width * count:
        raise source.fault(
            line,
            f"the frame row is cut short: {count} markers need {width * count} cells, "
            f"{len(cells)} follow",
        )
    if len(cells) > width * count and not file.overlong:
        file.overlong = True
        source.warn(f"frame rows have cells after their markers, first in line {line}; ignored")
    cells = cells[: width * count]
    coordinates = [cell for i, cell in enumerate(cells) if i % width < 3]
    file.points.append(source.numbers(coordinates, line, start))
    file.point_names.append(cells[width - 1 :: width])


def _take_body(file: _File, line: int, cells: list[str], source: Source) -> None:
    if len(cells) <= _LEAD:
        raise source.fault(line, f"the body row is cut short: {len(cells)} cells")
    identity = cells[4].strip()
    body = file.bodies.setdefault(identity, _BodyRows(cells[3].strip(), identity))
    markers = source.count(cells[6], line, "the marker count")
    if body.markers is None or not body.frames:
        body.markers = markers
    needed = _width(markers, file.version)
    if markers != body.markers or len(cells) != needed:
        raise source.fault(
            line,
            f"the row of {shown(body.name)} has {len(cells)} cells and {markers} markers; "
            f"{_width(body.markers, file.version)} cells and {body.markers} markers are expected",
        )
    body.frames.append(len(file.indices) - 1)
    body.lines.append(line)
    body.lost.append(source.count(cells[5], line, "frames since last tracked"))
    body.values.extend(source.numbers(cells[_LEAD:], line, _LEAD + 1))


def _check(file: _File, source: Source) -> None:
    if not file.indices:
        raise source.fault(1, "there is no row 'frame'; the file has no data")
    if not any(body.frames for body in file.bodies.values()):
        raise source.fault(file.lines[0], "there are no rigid bodies; the file has only points")
    for body in file.bodies.values():
        if body.markers is None and body.pose_frames:
            line = file.lines[body.pose_frames[0]]
            raise source.fault(
                line, f"the frame tracks a body {shown(body.id)} that no row defines"
            )
    count = file.info.get("framecount", "")
    if count != str(len(file.indices)):
        source.warn(f"the header says {shown(count)} frames, the file has {len(file.indices)}")


def _body(rows: _BodyRows, name: str, n: int, version: str, source: Source) -> BodyTake:
    m, width = rows.markers or 0, _MODEL_WIDTH[version]
    frames = np.array(rows.frames, dtype=np.int64)
    values = np.array(rows.values).reshape(len(frames), (width + 5) * m + 1)
    values = source.checked(values, rows.lines, f"body {shown(name)}")
    solved, measured = np.full((n, m, 3), np.nan), np.full((n, m, 3), np.nan)
    solved[frames] = values[:, : width * m].reshape(len(frames), m, width)[:, :, :3]
    measured[frames] = values[:, width * m : (width + 3) * m].reshape(len(frames), m, 3)
    missing = np.full(n, Missing.BLANK, dtype=np.int8)
    missing[frames] = np.where(np.array(rows.lost, dtype=np.int64) > 0, Missing.LOST, Missing.SEEN)
    unknown = ~known(solved.mean(axis=1)) if m else np.ones(n, dtype=bool)
    missing[unknown & (missing == Missing.SEEN)] = Missing.BLANK
    pose = np.full((n, 8), np.nan)
    seen_in = np.array(rows.pose_frames, dtype=np.int64)
    poses = np.array(rows.poses).reshape(len(seen_in), 7)
    pose[seen_in, 1:] = np.where(np.abs(poses) < 1e9, poses, np.nan)
    return BodyTake(
        name=name,
        id=rows.id,
        position=pose[:, 1:4],
        quaternion=usable(pose[:, _QUATERNION_WXYZ]),
        measured=measured,
        solved=solved,
        marker_names=tuple(f"Marker {k + 1}" for k in range(m)),
        missing=missing,
    )


def _cloud(file: _File, bodies: list[BodyTake], source: Source) -> Cloud:
    """Return the visible points without those that the body rows repeat digit for digit."""
    n, most = len(file.points), max(len(names) for names in file.point_names)
    points = np.full((n, most, 3), np.nan)
    names = np.full((n, most), "", dtype=object)
    for i, (row, labels) in enumerate(zip(file.points, file.point_names, strict=True)):
        points[i, : len(labels)] = np.reshape(row, (-1, 3))
        names[i, : len(labels)] = labels
    points = source.checked(points, file.lines, "a marker")
    free = known(points)
    for body in bodies:
        for k in range(body.measured.shape[1]):
            free &= ~np.all(points == body.measured[:, k, None, :], axis=2)
    return _compact(points, names, free)


def _compact(
    points: NDArray[np.float64], names: NDArray[np.object_], keep: NDArray[np.bool_]
) -> Cloud:
    order = np.argsort(~keep, axis=1, kind="stable")
    most = int(keep.sum(axis=1).max(initial=0))
    points = np.where(keep[:, :, None], points, np.nan)
    names = np.where(keep, names, "")
    points = np.take_along_axis(points, order[:, :, None], axis=1)[:, :most]
    return Cloud(points, np.take_along_axis(names, order, axis=1)[:, :most])
