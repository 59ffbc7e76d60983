"""Read Motive's column format, versions 1.2 to 1.25."""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.tracking.clock import jitter, motive_times, warn_of_index_steps
from workbench.tracking.missing import motive_missing
from workbench.tracking.motive_header import Entity, Layout, read_layout
from workbench.tracking.rotations import usable
from workbench.tracking.source import Source, shown, unique_name
from workbench.tracking.start_time import parse_start_time
from workbench.tracking.take import BodyTake, Cloud, Take

__all__ = ["parse_motive"]

_VERSIONS = ("1.2", "1.21", "1.22", "1.23", "1.24", "1.25")
_METRES = {"meters": 1.0, "centimeters": 0.01, "millimeters": 0.001, "inches": 0.0254}
_MARKER_TYPES = ("rigid body marker", "marker")


@dataclass(frozen=True)
class _Table:
    """The data rows: frame index (n,), line of each row, and all columns (n, k)."""

    indices: NDArray[np.int64]
    lines: array[int]
    values: NDArray[np.float64]


def parse_motive(source: Source) -> Take:
    """Turn the text of a Motive export into a take.

    Raises:
        TakeError: the file cannot be used; the message names file, line and cause.
    """
    layout = read_layout(source)
    table = _read_table(layout, source)
    rate = _rate(layout, table, source)
    column = None if layout.time_column is None else table.values[:, layout.time_column]
    times = motive_times(table.indices, column, rate, source)
    warn_of_index_steps(table.indices, source)
    _check_header(layout, len(table.indices), source)
    bodies, cloud = _bodies(layout, table, rate, source)
    return Take(
        path=source.path,
        sha256=source.sha256,
        format="motive",
        version=_version(layout, source),
        rate_hz=rate,
        jitter_s=jitter(table.indices, column),
        indices=table.indices,
        times=times,
        bodies=bodies,
        cloud=cloud,
        header=layout.header,
        warnings=tuple(source.warnings),
        began=parse_start_time(layout.header.get("Capture Start Time", "")),
    )


def _read_table(layout: Layout, source: Source) -> _Table:
    lines, values = array("l"), array("d")
    skip = _text_columns(layout)
    for line, cells in source.rows():
        if line <= layout.line or not any(cells):
            continue
        if len(cells) < layout.width:
            raise source.fault(
                line, f"the row is cut short: {len(cells)} cells, {layout.width} are needed"
            )
        cells = cells[: layout.width]
        for column in skip:
            cells[column] = ""
        lines.append(line)
        values.extend(source.numbers(cells, line, 1))
    if not lines:
        raise source.fault(layout.line, "no data rows follow the header")
    table = np.array(values).reshape(len(lines), layout.width)
    table = source.checked(table, lines, "a cell")
    return _Table(_indices(table[:, 0], lines, source), lines, table)


def _text_columns(layout: Layout) -> list[int]:
    """Return columns that belong to nothing we read, such as TimeCode: their cells may be text."""
    used = {0, layout.time_column}
    for entity in layout.entities:
        used.update(entity.position or ())
        used.update(column for _, column in entity.rotation)
    return [column for column in range(layout.width) if column not in used]


def _indices(column: NDArray[np.float64], lines: array[int], source: Source) -> NDArray[np.int64]:
    wrong = np.flatnonzero(~(column == np.round(column)))
    if len(wrong):
        value = column[wrong[0]]
        found = "blank" if np.isnan(value) else f"{value:g}"
        raise source.fault(lines[int(wrong[0])], f"the frame index is {found}, not a whole number")
    return column.astype(np.int64)


def _version(layout: Layout, source: Source) -> str:
    version = layout.header.get("Format Version", "")
    if version not in _VERSIONS:
        source.warn(f"format version {shown(version)} is not known; read like the nearest")
    return version


def _rate(layout: Layout, table: _Table, source: Source) -> float:
    text = layout.header.get("Export Frame Rate", "")
    try:
        rate = float(text)
    except ValueError:
        rate = float("nan")
    if 0.1 <= rate <= 1e5:
        return rate
    if layout.time_column is not None:
        steps = np.diff(table.values[:, layout.time_column])
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


def _scale(layout: Layout, source: Source) -> float:
    text = layout.header.get("Length Units", "")
    if not text:
        source.warn("the header gives no Length Units; metres assumed")
        return 1.0
    if text.casefold() not in _METRES:
        raise source.fault(1, f"Length Units is {shown(text)}; known are {', '.join(_METRES)}")
    return _METRES[text.casefold()]


def _bodies(
    layout: Layout, table: _Table, rate: float, source: Source
) -> tuple[dict[str, BodyTake], Cloud]:
    owners = [e for e in layout.entities if e.type == "rigid body"]
    if not owners:
        types = sorted({e.type for e in layout.entities})
        raise source.fault(
            layout.line, f"there are no rigid bodies; the columns are of type {', '.join(types)}"
        )
    scale = _scale(layout, source)
    markers: dict[int, list[tuple[Entity, str]]] = {i: [] for i in range(len(owners))}
    loose: list[Entity] = []
    for entity in layout.entities:
        if entity.type in _MARKER_TYPES and entity.position is not None:
            owner = _owner(entity, owners)
            if owner is None:
                loose.append(entity)
            else:
                markers[owner].append((entity, _slot(entity, owners[owner])))
    bodies: dict[str, BodyTake] = {}
    for i, owner in enumerate(owners):
        name = unique_name(owner.name, list(bodies), source)
        bodies[name] = _body(owner, name, markers[i], table, scale, rate)
    return bodies, _cloud(loose, table, scale)


def _owner(marker: Entity, owners: list[Entity]) -> int | None:
    """Return which body a marker belongs to: by parent, else by the longest body name before it."""
    best: int | None = None
    for i, owner in enumerate(owners):
        if marker.parent and marker.parent in (owner.name, owner.id):
            return i
        rest = marker.name.removeprefix(owner.name)
        named = owner.name and rest != marker.name and rest[:1] in ("_", ":", "-")
        if named and (best is None or len(owner.name) > len(owners[best].name)):
            best = i
    return best


def _slot(marker: Entity, owner: Entity) -> str:
    """Return a marker's name on its body, the same in every version: `_1` and `:Marker 001`."""
    rest = marker.name.removeprefix(owner.name).lstrip("_:- ")
    number = re.fullmatch(r"(?:marker)?[ _]?0*([0-9]{1,9})", rest, re.IGNORECASE | re.ASCII)
    return f"Marker {number[1]}" if number else rest


def _body(
    owner: Entity,
    name: str,
    markers: list[tuple[Entity, str]],
    table: _Table,
    scale: float,
    rate: float,
) -> BodyTake:
    slots = list(dict.fromkeys(slot for _, slot in markers))
    clouds = {kind: np.full((len(table.values), len(slots), 3), np.nan) for kind in _MARKER_TYPES}
    for entity, slot in markers:
        place, new = clouds[entity.type][:, slots.index(slot)], _position(entity, table, scale)
        np.copyto(place, new, where=np.isnan(place))  # a marker may continue in a second column
    position = _position(owner, table, scale)
    quaternion = _quaternion(owner, table)
    measured = clouds["marker"]
    return BodyTake(
        name=name,
        id=owner.id,
        position=position,
        quaternion=quaternion,
        measured=measured,
        solved=clouds["rigid body marker"],
        marker_names=tuple(slots),
        missing=motive_missing(position, quaternion, measured, rate),
    )


def _cloud(loose: list[Entity], table: _Table, scale: float) -> Cloud:
    if not loose:
        return Cloud.empty(len(table.values))
    position = np.stack([_position(entity, table, scale) for entity in loose], axis=1)
    names = np.array([entity.name for entity in loose], dtype=object)
    return Cloud(position, np.broadcast_to(names, position.shape[:2]))


def _position(entity: Entity, table: _Table, scale: float) -> NDArray[np.float64]:
    if entity.position is None:
        return np.full((len(table.values), 3), np.nan)
    values = table.values[:, list(entity.position)] * scale
    values[np.isnan(values).any(axis=1)] = np.nan
    return values


def _quaternion(entity: Entity, table: _Table) -> NDArray[np.float64]:
    """Return (n, 4) w, x, y, z from x, y, z, w or from Euler angles in degrees.

    Motive's Euler angles turn about the body's own axes, in the order of the columns.
    """
    order = "".join(axis for axis, _ in entity.rotation)
    quaternion = np.full((len(table.values), 4), np.nan)
    if not order:
        return quaternion
    if len(order) == 4:
        columns = dict(entity.rotation)
        return usable(table.values[:, [columns[axis] for axis in "WXYZ"]])
    angles = table.values[:, [column for _, column in entity.rotation]]
    given = np.isfinite(angles).all(axis=1)
    if given.any():
        turned = Rotation.from_euler(order, angles[given], degrees=True)
        quaternion[given] = turned.as_quat(scalar_first=True)
    return quaternion
