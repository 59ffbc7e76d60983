"""Write a take as Motive would export it: the virtual bench's camera, and our test data."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking.quaternions import euler_degrees
from workbench.tracking.take import BodyTake, Cloud, Take, known

__all__ = ["write_motive"]

MotiveVersion = Literal["1.21", "1.22", "1.23", "1.24", "1.25"]
_VERSIONS = ("1.21", "1.22", "1.23", "1.24", "1.25")
_UNITS = {"Meters": 1.0, "Centimeters": 100.0, "Millimeters": 1000.0}
_EULER = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


@dataclass(frozen=True)
class _Column:
    """One column: its header cells and its (n,) values, NaN for a blank cell."""

    type: str
    name: str
    id: str
    parent: str
    component: str
    axis: str
    values: NDArray[np.float64]


def write_motive(
    take: Take,
    path: str | Path,
    version: MotiveVersion = "1.23",
    rotation: str = "Quaternion",
    units: Literal["Meters", "Centimeters", "Millimeters"] = "Meters",
) -> None:
    """Write a take in Motive's column format.

    Reading the file gives the take back within the printed 6 decimals. Samples without a position
    have blank cells, as those of a lost body.

    Args:
        take: bodies with or without markers.
        path: the file; it is replaced.
        version: of the format.
        rotation: "Quaternion" or an Euler order such as "YXZ".
        units: of length.

    Raises:
        InputError: an unknown version, rotation or unit.
    """
    _check(version, rotation, units)
    columns = [
        column
        for body in take.bodies.values()
        for column in _pose_columns(body, version, rotation, _UNITS[units])
    ]
    for body in take.bodies.values():
        columns.extend(_marker_columns(body, body.measured, "Marker", version, _UNITS[units]))
    columns.extend(_cloud_columns(take.cloud, _UNITS[units]))
    lines = [*_head(take, columns, version, rotation, units), *_rows(take, columns)]
    Path(path).write_bytes("".join(f"{line}\r\n" for line in lines).encode())


def _check(version: str, rotation: str, units: str) -> None:
    for what, value, allowed in (
        ("version", version, _VERSIONS),
        ("rotation", rotation, ("Quaternion", *_EULER)),
        ("units", units, tuple(_UNITS)),
    ):
        if value not in allowed:
            raise InputError(f"Motive {what} {value!r} is unknown; there are {', '.join(allowed)}")


def _pose_columns(body: BodyTake, version: str, rotation: str, scale: float) -> Iterator[_Column]:
    blank = ~known(body.position)
    turn, axes = body.quaternion[:, [1, 2, 3, 0]], "XYZW"
    if rotation != "Quaternion":
        turn, axes = euler_degrees(body.quaternion, rotation), rotation
    parts = [("Rotation", axis, values) for axis, values in zip(axes, turn.T, strict=True)]
    parts += [("Position", a, v) for a, v in zip("XYZ", body.position.T * scale, strict=True)]
    error = "Error Per Marker" if version == "1.21" else "Mean Marker Error"
    parts.append((error, "", np.nan_to_num(body.fit_error) * scale))
    for component, axis, values in parts:
        values = np.where(blank, np.nan, values)
        yield _Column("Rigid Body", body.name, body.id, "", component, axis, values)
    solved = np.where(blank[:, None, None], np.nan, body.solved)
    yield from _marker_columns(body, solved, "Rigid Body Marker", version, scale)


def _marker_columns(
    body: BodyTake, markers: NDArray[np.float64], kind: str, version: str, scale: float
) -> Iterator[_Column]:
    for k, label in enumerate(body.marker_names):
        if kind == "Marker" and label in body.solved_only:
            continue
        name = _marker_name(body.name, label, kind, version)
        identity = body.id if kind == "Rigid Body Marker" else f"{body.id}{k + 1:08d}"
        for axis, values in zip("XYZ", markers[:, k].T * scale, strict=True):
            yield _Column(kind, name, identity, body.name, "Position", axis, values)
        if kind == "Rigid Body Marker":
            quality = np.where(known(markers[:, k]), 1.0, np.nan)
            yield _Column(kind, name, identity, body.name, "Marker Quality", "", quality)


def _marker_name(body: str, label: str, kind: str, version: str) -> str:
    """Return a marker's name; from 1.22 on solved and measured markers have the same one."""
    number = re.fullmatch(r"Marker (\d+)", label)
    if version == "1.21" and kind == "Rigid Body Marker":
        return f"{body}_{number[1] if number else label}"
    if number is None:
        return f"{body}:{label}"
    if version in ("1.24", "1.25"):
        return f"{body}:Marker {int(number[1]):03d}"
    return f"{body}:Marker{number[1]}"


def _cloud_columns(cloud: Cloud, scale: float) -> Iterator[_Column]:
    for k in range(cloud.position.shape[1]):
        names = {str(name) for name in cloud.names[:, k] if name}
        name = names.pop() if len(names) == 1 else f"Unlabeled {1000 + k}"
        for axis, values in zip("XYZ", cloud.position[:, k].T * scale, strict=True):
            yield _Column("Marker", name, f"{k + 1:016X}", "", "Position", axis, values)


def _head(
    take: Take, columns: list[_Column], version: str, rotation: str, units: str
) -> Iterator[str]:
    yield ",".join(_cell(text) for pair in _keys(take, version, rotation, units) for text in pair)
    yield ""
    words = ("", "", "") if version == "1.21" else ("Type", "Name", "ID")
    yield _row("", words[0], (_cell(c.type) for c in columns))
    yield _row("", words[1], (_cell(c.name) for c in columns))
    yield _row("", words[2], (_quoted(c.id) for c in columns))
    if version == "1.25":
        yield _row("", "Parent", (_cell(c.parent) for c in columns))
    yield _row("", "", (c.component for c in columns))
    time = "Time" if version in ("1.21", "1.22") else "Time (Seconds)"
    yield _row("Frame", time, (c.axis for c in columns))


def _keys(take: Take, version: str, rotation: str, units: str) -> Iterator[tuple[str, str]]:
    yield "Format Version", version
    yield "Take Name", take.header.get("Take Name", Path(take.path).stem)
    if version not in ("1.21", "1.22"):
        yield "Take Notes", take.header.get("Take Notes", "")
    yield "Capture Frame Rate", f"{take.rate_hz:.6f}"
    yield "Export Frame Rate", f"{take.rate_hz:.6f}"
    start = take.header.get("Capture Start Time", "2012-05-23 12.00.00.000 PM")
    yield "Capture Start Time", start
    if version not in ("1.21", "1.22"):
        yield "Capture Start Frame", take.header.get("Capture Start Frame", "0")
    yield "Total Frames in Take", str(len(take))
    yield "Total Exported Frames", str(len(take))
    yield "Rotation Type", rotation
    yield "Length Units", units
    yield "Coordinate Space", "Global"


def _rows(take: Take, columns: list[_Column]) -> Iterator[str]:
    table = np.column_stack([c.values for c in columns]) if columns else np.empty((len(take), 0))
    form = "".join([",%.6f"] * len(columns))
    for index, time, values in zip(take.indices, take.times, table, strict=True):
        yield f"{index},{time:.6f}" + (form % tuple(values.tolist())).replace("nan", "")


def _row(first: str, second: str, cells: Iterator[str]) -> str:
    return ",".join([first, second, *cells])


def _cell(text: str) -> str:
    return _quoted(text) if any(c in text for c in ',"\r\n') else text


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'
