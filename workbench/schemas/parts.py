"""A protocol with the files of steps that it includes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from workbench.errors import FileFault, FileFaults, did_you_mean
from workbench.schemas.experiment import PartFile, Protocol, Step
from workbench.schemas.files import Document, load
from workbench.schemas.prompt import OperatorPrompt
from workbench.schemas.wording import Location

__all__ = ["Parts", "load_protocol", "part_of"]

Parts = Mapping[Path, Document[PartFile]]
"""Resolved path -> what is there."""

_DEEPEST = 20  # parts inside each other


def load_protocol(path: Path) -> tuple[Document[Protocol], Parts]:
    """Read a protocol and all parts that it includes, and see that their pictures are there.

    Raises:
        InputError: when there is no such protocol.
        FileFaults: with all faults of the first file that has any; a part or picture that is
            missing, and a part that includes itself, is a fault of the line that names it.
    """
    protocol = load(path, Protocol)
    parts: dict[Path, Document[PartFile]] = {}
    _collect(protocol, (path.resolve(),), parts)
    return protocol, parts


def part_of(document: Document[Protocol] | Document[PartFile], name: str) -> Path:
    """Return where a part is that a file includes."""
    return (document.path.parent / name).resolve()


def _missing_pictures(document: Document[Protocol] | Document[PartFile]) -> Iterator[FileFault]:
    """Yield a fault for each prompt whose picture is not there, or is no file."""
    for location, prompt in _prompts(document.content.steps):
        if prompt.picture is None:
            continue
        picture = document.path.parent / prompt.picture
        if not os.path.isfile(picture):  # a name may be too long for `Path.is_file`
            wrong = "a folder, no picture" if os.path.isdir(picture) else "no such picture"
            folder = picture.parent
            near = os.listdir(folder) if os.path.isdir(folder) else []
            near = [name for name in near if Path(name).suffix == picture.suffix]
            hint = did_you_mean(picture.name, near)
            yield document.fault((*location, "picture"), f"{wrong}: {picture}{hint}")


def _prompts(steps: Sequence[Step]) -> Iterator[tuple[Location, OperatorPrompt]]:
    """Yield each prompt of some steps, and its position."""
    for i, step in enumerate(steps):
        if step.prompt is not None:
            yield ("steps", i, "prompt"), step.prompt
        for name in ("run", "sweep", "staircase"):
            condition = getattr(step, name)
            for key in ("before", "after"):
                for k, prompt in enumerate(getattr(condition, key, ())):
                    yield ("steps", i, name, key, k), prompt


def _collect(
    document: Document[Protocol] | Document[PartFile],
    above: tuple[Path, ...],
    parts: dict[Path, Document[PartFile]],
) -> None:
    faults = list(_missing_pictures(document))
    for i, step in enumerate(document.content.steps):
        if step.include is None:
            continue
        path = part_of(document, step.include)
        location = ("steps", i, "include")
        if path in above:
            way = " -> ".join(p.name for p in (*above[above.index(path) :], path))
            faults.append(document.fault(location, f"a part that includes itself: {way}"))
            continue
        if path in parts:
            continue
        if len(above) > _DEEPEST:
            faults.append(document.fault(location, f"more than {_DEEPEST} parts inside each other"))
            continue
        if not os.path.isfile(path):
            faults.append(document.fault(location, f"no such file: {path}"))
            continue
        parts[path] = load(path, PartFile)
        _collect(parts[path], (*above, path), parts)
    if faults:
        raise FileFaults(faults)
