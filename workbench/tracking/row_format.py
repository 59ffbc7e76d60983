"""Read the row formats 1.0 and 1.1 of Tracking Tools: the first cell names the kind of row."""

from __future__ import annotations

import numpy as np

from workbench.tracking.clock import jitter, row_clock, warn_of_index_steps
from workbench.tracking.labels import bodies_by_label, owners_of, warn_of_no_bodies
from workbench.tracking.missing import without_zeros
from workbench.tracking.quaternions import usable
from workbench.tracking.row_bulk import read_bulk
from workbench.tracking.row_poses import with_own_poses
from workbench.tracking.row_strict import read_strict
from workbench.tracking.row_table import MODEL_WIDTH, BodyRows, RowTable, version_of
from workbench.tracking.source import Source, shown, unique_name
from workbench.tracking.take import BodyTake, Cloud, SampleStatus, Take, known

__all__ = ["parse_row"]

_BLOCK = 4096  # frames whose points are compared at a time, so that they stay in the cache
_WXYZ = [6, 3, 4, 5]  # columns of the quaternion in a pose


def parse_row(source: Source) -> Take:
    """Turn the text of a row-format export into a take.

    Raises:
        TakeError: the file cannot be used; the message names file, line and cause.
    """
    version = version_of(source)
    table = (source.large and read_bulk(source, version)) or read_strict(source, version)
    table = with_own_poses(table, source)
    _check_header(table, source)
    warn_of_index_steps(table.indices, source)
    bodies: dict[str, BodyTake] = {}
    for rows in table.bodies:
        if len(rows.frames) or rows.posed.any():
            name = unique_name(rows.name, list(bodies), source)
            read = _body if len(rows.frames) else _posed
            bodies[name] = read(rows, name, table, source)
    cloud = _cloud(table, list(bodies.values()), source)
    if not bodies:
        bodies, cloud = _from_labels(cloud, source)
    rate, times = row_clock(table.indices, table.times, source)
    return Take(
        path=source.path,
        sha256=source.sha256(),
        format="row",
        version=version,
        rate_hz=rate,
        jitter_s=jitter(table.indices, table.times),
        indices=table.indices,
        times=times,
        bodies=bodies,
        cloud=cloud,
        header=table.info,
        warnings=tuple(source.warnings),
        unit_stated=False,
    )


def _check_header(table: RowTable, source: Source) -> None:
    """Warn where the header and the rows disagree; rewritten files often do."""
    count = table.info.get("framecount", "")
    if count != str(len(table.indices)):
        source.warn(f"the header says {shown(count)} frames, the file has {len(table.indices)}")
    for key in ("trackablecount", "rigidbodycount"):
        if table.info.get(key, str(len(table.bodies))) != str(len(table.bodies)):
            source.warn(
                f"the header says {shown(table.info[key])} bodies, the file has {len(table.bodies)}"
            )
    for rows in table.bodies:
        rows_of = np.bincount(rows.frames, minlength=len(table.indices))
        without_row = np.count_nonzero(rows_of == 0)
        if not len(rows.frames) and rows.posed.any():
            source.warn(
                f"body {shown(rows.name)} has no rows of its own, only poses in the frame rows; "
                "its markers are unknown"
            )
        elif not len(rows.frames):
            source.warn(f"body {shown(rows.name)} is defined and has no rows; left out")
        elif without_row:
            source.warn(
                f"body {shown(rows.name)} has no row in {without_row} frame(s); missing there"
            )


def _body(rows: BodyRows, name: str, table: RowTable, source: Source) -> BodyTake:
    n, m, width = len(table.indices), rows.markers, MODEL_WIDTH[table.version]
    frames, values = rows.frames, rows.values
    if not np.array_equal(frames, np.arange(n)):
        values = np.full((n, values.shape[1]), np.nan)
        values[frames] = rows.values
    solved = values[:, : width * m].reshape(n, m, width)[:, :, :3]
    measured = values[:, width * m : (width + 3) * m].reshape(n, m, 3)
    measured = without_zeros(measured, f"markers of {name!r}", table.indices, source.warn)
    solved = without_zeros(solved, f"model markers of {name!r}", table.indices, source.warn)
    missing = np.full(n, SampleStatus.BLANK, dtype=np.int8)
    missing[frames] = np.where(rows.lost > 0, SampleStatus.LOST, SampleStatus.SEEN)
    unknown = ~known(solved).all(axis=1) if m else np.ones(n, dtype=bool)
    missing[unknown & (missing == SampleStatus.SEEN)] = SampleStatus.BLANK
    return BodyTake(
        name=name,
        id=rows.id,
        position=rows.poses[:, :3],
        quaternion=usable(rows.poses[:, _WXYZ]),
        measured=measured,
        solved=solved,
        marker_names=tuple(f"Marker {k + 1}" for k in range(m)),
        missing=missing,
        reported_error=values[:, -1],
        marker_quality=values[:, (width + 4) * m : -1],
    )


def _posed(rows: BodyRows, name: str, table: RowTable, source: Source) -> BodyTake:
    """Return a body of poses alone; a frame row lists the bodies that it tracks."""
    n = len(table.indices)
    missing = np.where(rows.posed, SampleStatus.SEEN, SampleStatus.LOST).astype(np.int8)
    missing[rows.posed & ~known(rows.poses)] = SampleStatus.BLANK
    none = np.empty((n, 0, 3))
    return BodyTake(
        name=name,
        id=rows.id,
        position=rows.poses[:, :3],
        quaternion=usable(rows.poses[:, _WXYZ]),
        measured=none,
        solved=none,
        marker_names=(),
        missing=missing,
    )


def _cloud(table: RowTable, bodies: list[BodyTake], source: Source) -> Cloud:
    """Return the visible points without those that the body rows repeat digit for digit."""
    seen = without_zeros(table.points, "visible points", table.indices, source.warn)
    free = np.ascontiguousarray(known(seen).T)  # (k, n): frames along the fast axis
    for start in range(0, len(seen), _BLOCK):
        block = slice(start, start + _BLOCK)
        x, y, z = seen[block].transpose(2, 1, 0)  # (k, frames) each
        for body in bodies:
            for marker in body.measured[block].transpose(1, 2, 0):
                for k in np.flatnonzero((x == marker[0]).any(axis=1)):  # mostly one
                    same = (x[k] == marker[0]) & (y[k] == marker[1]) & (z[k] == marker[2])
                    free[k, block] &= ~same
    free = free.T
    if not free.any():
        return Cloud.empty(len(free))
    most = int(free.sum(axis=1).max())
    order = np.argsort(~free, axis=1, kind="stable")[:, :most]
    free = np.take_along_axis(free, order, axis=1)
    points = np.take_along_axis(table.points, order[:, :, None], axis=1)
    names = np.array(table.vocabulary, dtype=object)[
        np.take_along_axis(table.labels, order, axis=1)
    ]
    return Cloud(np.where(free[:, :, None], points, np.nan), np.where(free, names, ""))


def _from_labels(cloud: Cloud, source: Source) -> tuple[dict[str, BodyTake], Cloud]:
    """Make bodies of a file of points alone, whose order in a frame is arbitrary."""
    names = sorted({str(name) for name in cloud.names.flat if name})
    labels = [name for name, owner in zip(names, owners_of(names), strict=True) if owner]
    if not labels:
        warn_of_no_bodies(names, cloud.position, 1, source)
        return {}, cloud
    position, free = np.full((len(cloud.names), len(labels), 3), np.nan), known(cloud.position)
    for k, label in enumerate(labels):
        frame, slot = np.nonzero(cloud.names == label)
        position[frame, k] = cloud.position[frame, slot]
        free[frame, slot] = False
    bodies, _ = bodies_by_label(labels, position, source)
    rest = np.where(free[:, :, None], cloud.position, np.nan)
    return bodies, Cloud(rest, np.where(free, cloud.names, ""))
