"""A protocol with the files of steps that it includes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from workbench.errors import FileFault, FileFaults
from workbench.protocol.experiment import Part, Protocol
from workbench.protocol.files import Document, load

__all__ = ["Parts", "load_protocol", "part_of"]

Parts = Mapping[Path, Document[Part]]
"""Resolved path -> what stands there."""


def load_protocol(path: Path) -> tuple[Document[Protocol], Parts]:
    """Read a protocol and all parts that it includes, at any depth.

    Raises:
        InputError: when there is no such protocol.
        FileFaults: with all faults of the first file that has any; a part that is missing or
            includes itself is a fault of the line that names it.
    """
    protocol = load(path, Protocol)
    parts: dict[Path, Document[Part]] = {}
    _collect(protocol, (path.resolve(),), parts)
    return protocol, parts


def part_of(document: Document[Protocol] | Document[Part], name: str) -> Path:
    """Return where a part is that a file includes."""
    return (document.path.parent / name).resolve()


def _collect(
    document: Document[Protocol] | Document[Part],
    above: tuple[Path, ...],
    parts: dict[Path, Document[Part]],
) -> None:
    faults: list[FileFault] = []
    for i, step in enumerate(document.content.steps):
        if step.include is None:
            continue
        place = part_of(document, step.include)
        location = ("steps", i, "include")
        if place in above:
            way = " -> ".join(p.name for p in (*above[above.index(place) :], place))
            faults.append(document.fault(location, f"a part that includes itself: {way}"))
            continue
        if place in parts:
            continue
        if not place.is_file():
            faults.append(document.fault(location, f"no such file: {place}"))
            continue
        parts[place] = load(place, Part)
        _collect(parts[place], (*above, place), parts)
    if faults:
        raise FileFaults(faults)
