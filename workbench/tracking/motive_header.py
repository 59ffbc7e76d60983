"""The header of Motive's column format: keys, and the meaning of each column.

Header rows are never counted. The row whose first cell is `Frame` names the axes; the rows above it
give type, name, id, perhaps parent, and component. Format 1.21 leaves the words `Type`, `Name`
and `ID` out, so there the rows count in this order.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from workbench.tracking.source import Source, shown

__all__ = ["ColumnLayout", "Entity", "is_number", "read_layout"]

_LABELS = ("type", "name", "id", "parent")
_UNNAMED = ("type", "name", "id")
"""The rows of the versions that leave the words out; only the latest has a parent."""
_ERRORS = ("mean marker error", "error per marker")
_QUALITY = "marker quality"
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
        error: column of the error that Motive reports; None where there is none.
        quality: column of a marker's quality; None where there is none.
    """

    type: str
    name: str
    id: str
    parent: str
    position: tuple[int, int, int] | None
    rotation: tuple[tuple[str, int], ...]
    error: int | None
    quality: int | None

    @property
    def columns(self) -> tuple[int, ...]:
        """All columns of it that mean something."""
        turn = (column for _, column in self.rotation)
        others = (column for column in (self.error, self.quality) if column is not None)
        return (*(self.position or ()), *turn, *others)


@dataclass(frozen=True)
class ColumnLayout:
    """Content of the header.

    Args:
        header: the key row as pairs.
        line: of the axis row; data follow.
        entities: in the file's order.
        time_column: None when the file has none.
        width: cells of a data row.
    """

    header: dict[str, str]
    line: int
    entities: tuple[Entity, ...]
    time_column: int | None
    width: int

    @property
    def columns(self) -> tuple[int, ...]:
        """The columns to read, the frame index first; others, as TimeCode, may hold text."""
        used = {column for entity in self.entities for column in entity.columns}
        time = () if self.time_column is None else (self.time_column,)
        return (0, *sorted(used.union(time) - {0}))


def read_layout(source: Source) -> ColumnLayout:
    """Read the header rows.

    Raises:
        TakeError: when a header row is missing or there are no data columns.
    """
    keys, above, line, axes = _header_rows(source)
    labelled = _label(above, line, source)
    entities = _entities(labelled, axes, line, source)
    if not any(e.position or e.rotation for e in entities):
        kinds = ", ".join(dict.fromkeys(filter(None, labelled["type"][2:])))
        suffix = f"; the columns are of type {kinds}" if kinds else " (was anything selected?)"
        raise source.fault(line, f"there are no data columns; the export is empty{suffix}")
    width = max(_filled(cells) for cells in (axes, *labelled.values()))
    return ColumnLayout(_pairs(keys), line, entities, _time_column(axes), width)


def _header_rows(source: Source) -> tuple[list[str], list[list[str]], int, list[str]]:
    rows = source.rows()
    _, keys = next(rows)
    above: list[list[str]] = []
    for line, cells in rows:
        if cells[0].strip().casefold() == "frame":
            return keys, above, line, [cell.strip() for cell in cells]
        if is_number(cells[0]):
            raise source.fault(line, "data begin without the header row that starts with 'Frame'")
        if cells[0].strip():
            source.warn(f"the header row in line {line} begins with {shown(cells[0])}; ignored")
        above.append([cell.strip() for cell in cells])
    raise source.fault(
        1, "the header ends without the row that starts with 'Frame'; file cut off? Export it again"
    )


def _label(above: list[list[str]], line: int, source: Source) -> dict[str, list[str]]:
    """Return the header rows by what they hold."""
    if len(above) < 3:
        raise source.fault(
            line,
            f"{len(above)} header rows are above 'Frame'; needed are type, name, id, component",
        )
    labelled = {"component": above[-1]}
    unnamed = iter(_UNNAMED)
    for cells in above[:-1]:
        words = (cell.casefold() for cell in reversed(cells[:2]))  # the second one is Motive's
        label = next((word for word in words if word in _LABELS), "") or next(unnamed, "")
        if not label:
            raise source.fault(
                line, "more header rows are above 'Frame' than type, name, id and component"
            )
        labelled.setdefault(label, cells)
    for needed in ("type", "name"):
        if needed not in labelled:
            raise source.fault(line, f"no header row above this one gives the {needed}")
    return labelled


def _entities(
    labelled: dict[str, list[str]], axes: Sequence[str], line: int, source: Source
) -> tuple[Entity, ...]:
    """Group neighbouring columns of the same type, name and id; names alone may repeat."""
    found: list[tuple[tuple[str, ...], dict[str, int]]] = []
    for column in range(2, max(len(axes), _filled(labelled["type"]))):
        key = tuple(_cell(labelled.get(label), column) for label in _LABELS)
        component = _cell(labelled["component"], column).casefold()
        part = f"{component} {_cell(axes, column).upper()}".strip()
        if not found or key != found[-1][0] or part in found[-1][1]:
            found.append((key, {}))
        found[-1][1][part] = column
    for key, parts in found:
        _check_entity(key, parts, line, source)
    return tuple(_entity(key, parts) for key, parts in found if _type(key[0]) in _TYPES)


def _check_entity(key: tuple[str, ...], parts: dict[str, int], line: int, source: Source) -> None:
    """Refuse columns that a damaged header leaves half named."""
    kind, name = _type(key[0]), key[1]
    place, turn = _axes_of("position", parts), _axes_of("rotation", parts)
    if kind not in _TYPES and not place and not turn:
        return
    column = min(parts.values()) + 1
    if not kind or not name:
        absent = "name" if kind else "type"
        raise source.fault(line, f"the header rows above give column {column} no {absent}")
    if kind not in _TYPES:
        source.warn(f"columns of type {kind!r} are not read")
    elif place != "XYZ" or turn not in ("", "XYZ", "WXYZ"):
        raise source.fault(
            line,
            f"the columns of {kind} {name!r} from {column} on are incomplete: "
            f"position {place or 'none'}, rotation {turn or 'none'}",
        )


def _axes_of(component: str, parts: dict[str, int]) -> str:
    """Return the axis letters that a component has, in alphabetical order."""
    return "".join(sorted(part[-1] for part in parts if part.startswith(f"{component} ")))


def _entity(key: tuple[str, ...], parts: dict[str, int]) -> Entity:
    kind, name, identity, parent = key
    x, y, z = (parts.get(f"position {axis}") for axis in "XYZ")
    turn = {k[-1]: column for k, column in parts.items() if re.fullmatch("rotation [XYZW]", k)}
    return Entity(
        type=_type(kind),
        name=name,
        id=identity,
        parent=parent,
        position=None if x is None or y is None or z is None else (x, y, z),
        rotation=tuple(turn.items()),
        error=next((parts[word] for word in _ERRORS if word in parts), None),
        quality=parts.get(_QUALITY),
    )


def _type(text: str) -> str:
    plain = text.casefold().replace(" ", "")
    return next((known for known in _TYPES if known.replace(" ", "") == plain), plain)


def is_number(text: str) -> bool:
    """Return whether a cell holds a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _filled(cells: Sequence[str]) -> int:
    """Return the number of cells up to the last one that is not blank."""
    return max((i + 1 for i, cell in enumerate(cells) if cell), default=0)


def _cell(cells: Sequence[str] | None, column: int) -> str:
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
