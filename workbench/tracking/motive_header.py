"""The header of Motive's column format: key row, and what each column means.

Header rows are never counted. The row whose first cell is `Frame` names the axes; the rows above it
give type, name, id, perhaps parent, and component. Format 1.21 leaves the words `Type`, `Name`
and `ID` out, so there the rows count in this order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.tracking.source import Source

__all__ = ["Entity", "Layout", "read_layout"]

_LABELS = ("type", "name", "id", "parent")
_COMPONENTS = ("rotation", "position")
_TYPES = ("rigid body", "rigid body marker", "marker", "bone", "bone marker")


@dataclass(frozen=True)
class Entity:
    """One thing the file tracks, and its columns.

    Args:
        type: lower case, e.g. "rigid body".
        name: as the file gives it.
        id: as the file gives it.
        parent: of format 1.25, else empty.
        position: the three columns of X, Y, Z; None when the file gives no position.
        rotation: axis letter and column, in the file's order; three for Euler angles.
    """

    type: str
    name: str
    id: str
    parent: str
    position: tuple[int, int, int] | None
    rotation: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Layout:
    """What the header says.

    Args:
        header: the key row as pairs.
        line: of the axis row; data follow.
        entities: in the file's order.
        time_column: None when the file has none.
        width: cells that a data row must have at least.
    """

    header: dict[str, str]
    line: int
    entities: tuple[Entity, ...]
    time_column: int | None
    width: int


def read_layout(source: Source) -> Layout:
    """Read the header rows.

    Raises:
        TakeError: when a header row is missing or there are no data columns.
    """
    keys, above, line, axes = _header_rows(source)
    labelled = _label(above, line, source)
    entities = _entities(labelled, axes)
    columns = [c for e in entities for c in (*(e.position or ()), *(c for _, c in e.rotation))]
    if not columns:
        raise source.fault(
            line, "there are no data columns; the export is empty (was anything selected?)"
        )
    return Layout(_pairs(keys), line, entities, _time_column(axes), max(columns) + 1)


def _header_rows(source: Source) -> tuple[list[str], list[list[str]], int, list[str]]:
    rows = source.rows()
    _, keys = next(rows)
    above: list[list[str]] = []
    for line, cells in rows:
        if cells[0].strip().casefold() == "frame":
            return keys, above, line, [cell.strip() for cell in cells]
        if cells[0].strip():
            raise source.fault(line, "data begin without the header row that starts with 'Frame'")
        above.append([cell.strip() for cell in cells])
    raise source.fault(1, "the header ends without the row that starts with 'Frame'; file cut off?")


def _label(above: list[list[str]], line: int, source: Source) -> dict[str, list[str]]:
    """Return the header rows by what they hold."""
    if len(above) < 3:
        raise source.fault(
            line,
            f"{len(above)} header rows stand above 'Frame'; needed are type, name, id, component",
        )
    labelled = {"component": above[-1]}
    unnamed = iter(_LABELS)
    for cells in above[:-1]:
        word = next((cell.casefold() for cell in cells[:2] if cell), "")
        label = word if word in _LABELS else next(unnamed, "")
        labelled.setdefault(label, cells)
    for needed in ("type", "name"):
        if needed not in labelled:
            raise source.fault(line, f"no header row above this one gives the {needed}")
    return labelled


def _entities(labelled: dict[str, list[str]], axes: Sequence[str]) -> tuple[Entity, ...]:
    """Group neighbouring columns of the same type, name and id; names alone may repeat."""
    found: list[Entity] = []
    open_key, position, rotation = None, {}, {}
    for column in range(2, len(axes) + 1):
        key = tuple(_cell(labelled.get(label), column) for label in _LABELS)
        component = _cell(labelled["component"], column).casefold()
        axis = (axes[column] if column < len(axes) else "").upper()
        fresh = key != open_key or (component == "position" and axis in position)
        if fresh and open_key is not None:
            found.append(_entity(open_key, position, rotation))
        if fresh:
            open_key, position, rotation = key, {}, {}
        if component == "position" and axis:
            position[axis] = column
        elif component == "rotation" and axis:
            rotation[axis] = column
    if open_key is not None:
        found.append(_entity(open_key, position, rotation))
    return tuple(e for e in found if e.type in _TYPES)


def _entity(key: tuple[str, ...], position: dict[str, int], rotation: dict[str, int]) -> Entity:
    kind, name, identity, parent = key
    place = (position["X"], position["Y"], position["Z"]) if set(position) == set("XYZ") else None
    turn = tuple(rotation.items()) if set(rotation) in ({*"XYZ"}, {*"XYZW"}) else ()
    return Entity(_type(kind), name, identity, parent, place, turn)


def _type(text: str) -> str:
    plain = text.casefold().replace(" ", "")
    return next((known for known in _TYPES if known.replace(" ", "") == plain), plain)


def _cell(cells: list[str] | None, column: int) -> str:
    return cells[column] if cells is not None and column < len(cells) else ""


def _pairs(keys: list[str]) -> dict[str, str]:
    return {
        key.strip(): value.strip()
        for key, value in zip(keys[::2], keys[1::2], strict=False)
        if key.strip()
    }


def _time_column(axes: Sequence[str]) -> int | None:
    for column, name in enumerate(axes):
        if name.casefold().startswith("time") and not name.casefold().startswith("timecode"):
            return column
    return None
