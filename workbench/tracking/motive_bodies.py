"""The bodies of a Motive table: their markers, metres, quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.tracking.labels import (
    bodies_by_label,
    marker_name,
    merge,
    side_by_side,
    warn_of_no_bodies,
)
from workbench.tracking.missing import motive_missing, never_moves, without_zeros
from workbench.tracking.motive_header import ColumnLayout, Entity
from workbench.tracking.motive_table import MotiveTable
from workbench.tracking.quaternions import usable
from workbench.tracking.source import Source, listed, shown, unique_name
from workbench.tracking.take import BodyTake, Cloud, SampleStatus, known

__all__ = ["bodies_and_cloud", "scale"]

_METRES = {"meters": 1.0, "centimeters": 0.01, "millimeters": 0.001, "inches": 0.0254}
_BODIES = ("rigid body", "bone")
_MEASURED = "marker"
_MANY = 10  # rows


@dataclass(frozen=True)
class _Scaled:
    """A table and its unit of length [m]."""

    table: MotiveTable
    metres: float

    def position(self, entity: Entity) -> NDArray[np.float64]:
        """Return (n, 3) [m]; NaN where a coordinate is missing."""
        if entity.position is None:
            return np.full((len(self.table), 3), np.nan)
        values = self.table.block(entity.position)
        if self.metres != 1.0:
            values = self.metres * values
        blank = self.table.blank[self.table.places(entity.position)]
        unknown = np.asarray(blank.any(axis=0))
        if (unknown != blank.all(axis=0)).any():
            values = np.where(unknown[:, None], np.nan, values)
        return values

    def error(self, entity: Entity) -> NDArray[np.float64] | None:
        """Return (n,) [m] the error that Motive reports."""
        return None if entity.error is None else self.table.column(entity.error) * self.metres


def bodies_and_cloud(
    layout: ColumnLayout, table: MotiveTable, metres: float, rate: float, source: Source
) -> tuple[dict[str, BodyTake], Cloud]:
    """Return the bodies by name and the measured points that belong to none.

    Args:
        layout: of the file.
        table: its numbers.
        metres: in its unit of length.
        rate: of the samples [Hz].
        source: the file.

    Raises:
        TakeError: there are neither bodies nor markers.
    """
    scaled = _Scaled(table, metres)
    owners = [entity for entity in layout.entities if entity.type in _BODIES]
    if not owners:
        return _from_labels(layout, scaled, source)
    markers_of: list[list[Entity]] = [[] for _ in owners]
    loose: list[Entity] = []
    for entity in layout.entities:
        if entity.type not in _BODIES:
            owner = _owner(entity, owners, source)
            (loose if owner is None else markers_of[owner]).append(entity)
    raw = [any(marker.type == _MEASURED for marker in markers) for markers in markers_of]
    bodies: dict[str, BodyTake] = {}
    for k, owner in enumerate(owners):
        name = unique_name(owner.name, list(bodies), source)
        others_raw = any(raw[:k] + raw[k + 1 :])
        bodies[name] = _body(owner, name, markers_of[k], scaled, rate, others_raw, source)
    return bodies, _cloud([e for e in loose if e.type == _MEASURED], scaled, source)


def scale(layout: ColumnLayout, source: Source) -> float:
    """Return the file's unit of length [m].

    Raises:
        TakeError: the unit is unknown.
    """
    text = layout.header.get("Length Units", "")
    if not text:
        source.warn("the header gives no Length Units; metres assumed")
        return 1.0
    if text.casefold() not in _METRES:
        raise source.fault(1, f"Length Units is {shown(text)}; known are {', '.join(_METRES)}")
    return _METRES[text.casefold()]


def _from_labels(
    layout: ColumnLayout, scaled: _Scaled, source: Source
) -> tuple[dict[str, BodyTake], Cloud]:
    """Make bodies of an export of markers alone."""
    markers = [entity for entity in layout.entities if entity.type == _MEASURED]
    cloud = _cloud(markers, scaled, source)
    labels = [entity.name for entity in markers]
    bodies, loose = bodies_by_label(labels, cloud.position, source)
    if not markers:
        types = ", ".join(sorted({entity.type for entity in layout.entities}))
        raise source.fault(
            layout.line,
            f"there are no rigid bodies and no measured markers; the columns are of type {types}, "
            f"named {listed(entity.name for entity in layout.entities)}",
        )
    if not bodies:
        warn_of_no_bodies(labels, cloud.position, layout.line, source)
    return bodies, _cloud([markers[k] for k in loose], scaled, source)


def _owner(marker: Entity, owners: Sequence[Entity], source: Source) -> int | None:
    """Return the body of a marker: by parent, else by the longest body name before its own.

    Of bodies with the same name it is the one whose id it has; None where that is unknown.
    """
    found = [i for i, o in enumerate(owners) if marker.parent and marker.parent in (o.name, o.id)]
    if not found:
        found = [i for i, o in enumerate(owners) if _is_named_after(marker, o)]
        longest = max((len(owners[i].name) for i in found), default=0)
        found = [i for i in found if len(owners[i].name) == longest]
    if len(found) > 1:
        name = owners[found[0]].name
        found = [i for i in found if owners[i].id and marker.id.startswith(owners[i].id)]
        if len(found) != 1:
            source.warn(f"markers of the bodies named {name!r} cannot be assigned; left out")
            return None
    return found[0] if found else None


def _is_named_after(marker: Entity, owner: Entity) -> bool:
    rest = marker.name.removeprefix(owner.name)
    return rest != marker.name and rest[:1] in ("_", ":", "-")


def _body(
    owner: Entity,
    name: str,
    markers: Sequence[Entity],
    scaled: _Scaled,
    rate: float,
    others_raw: bool,
    source: Source,
) -> BodyTake:
    names = [marker_name(marker.name.removeprefix(owner.name)) for marker in markers]
    slots = tuple(dict.fromkeys(names))
    n = len(scaled.table)
    paths: dict[str, dict[str, NDArray[np.float64]]] = {"measured": {}, "solved": {}}
    quality = np.full((n, len(slots)), np.nan)
    for marker, slot in zip(markers, names, strict=True):
        kind = "measured" if marker.type == _MEASURED else "solved"
        merge(paths[kind], slot, scaled.position(marker), marker.name, source)
        if marker.quality is not None:
            quality[:, slots.index(slot)] = scaled.table.column(marker.quality)
    measured, solved = (side_by_side(paths[kind], slots, n) for kind in ("measured", "solved"))
    indices = scaled.table.indices
    measured = without_zeros(measured, f"markers of {name!r}", indices, source.warn)
    solved = without_zeros(solved, f"solved markers of {name!r}", indices, source.warn)
    position, quaternion = scaled.position(owner), _quaternion(owner, scaled.table)
    missing = motive_missing(position, quaternion, measured, rate, others_raw=others_raw)
    _warn_of_one_pose(name, position, quaternion, measured, missing, source)
    return BodyTake(
        name=name,
        id=owner.id,
        position=position,
        quaternion=quaternion,
        measured=measured,
        solved=solved,
        marker_names=slots,
        missing=missing,
        reported_error=scaled.error(owner),
        marker_quality=quality if any(marker.quality is not None for marker in markers) else None,
        solved_only=frozenset(slots) - paths["measured"].keys(),
    )


def _warn_of_one_pose(
    name: str,
    position: NDArray[np.float64],
    quaternion: NDArray[np.float64],
    measured: NDArray[np.float64],
    missing: NDArray[np.int8],
    source: Source,
) -> None:
    """Warn of a body that has the same pose in all of many rows: cameras are never that still."""
    if known(measured).any():
        return
    given = known(position) & (missing != SampleStatus.PLACEHOLDER)
    count = int(np.count_nonzero(given))
    if count < _MANY or not never_moves(position[given], quaternion[given]):
        return
    verdict = "was it ever tracked?"
    if not (missing == SampleStatus.SEEN).any():
        verdict = "it counts as never seen, as no raw marker of it is in the file"
    source.warn(
        f"body {name!r} has the very same pose in all {count} rows that give one, which cameras "
        f"never see: {verdict}"
    )


def _cloud(loose: Sequence[Entity], scaled: _Scaled, source: Source) -> Cloud:
    if not loose:
        return Cloud.empty(len(scaled.table))
    position = np.stack([scaled.position(entity) for entity in loose], axis=1)
    names = np.array([entity.name for entity in loose], dtype=object)
    position = without_zeros(position, "markers of no body", scaled.table.indices, source.warn)
    return Cloud(position, np.broadcast_to(names, position.shape[:2]))


def _quaternion(entity: Entity, table: MotiveTable) -> NDArray[np.float64]:
    """Return (n, 4) w, x, y, z from x, y, z, w or from Euler angles in degrees.

    Motive's Euler angles turn about the body's own axes, in the order of the columns.
    """
    columns = dict(entity.rotation)
    if len(columns) == 4:
        return usable(table.block([columns[axis] for axis in "WXYZ"]))
    quaternion = np.full((len(table), 4), np.nan)
    if columns:
        angles = table.block(list(columns.values()))
        given = np.isfinite(angles).all(axis=1)
        if given.any():
            turned = scipy.spatial.transform.Rotation.from_euler(
                "".join(columns), angles[given], degrees=True
            )
            quaternion[given] = turned.as_quat(scalar_first=True)
    return quaternion
