"""What of a damaged manifest can still be read."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar, cast

from pydantic import BaseModel, TypeAdapter, ValidationError

from workbench.bundle.inside import foreign
from workbench.bundle.manifest import SECTIONS, Manifest, split
from workbench.bundle.names import MANIFEST, NAMED

__all__ = ["recovered_manifest"]

_KEY = re.compile(r'\n(?=  ")')  # a manifest has one key of its own a line, indented by two


def recovered_manifest(folder: Path) -> Manifest:
    """Return what of a manifest can be read, and what the folder's name says of the rest.

    What was asked for is always there, so that whoever shows the run needs no care; what nobody
    knows is empty, and the mode of an unknown name is `hop`.
    """
    rest = NAMED.sub("", folder.name)
    facts: dict[str, Any] = {
        "id": folder.name,
        "status": "failed",
        "created": _created(folder.name),
        "kind": "run",
        "title": rest or folder.name,
        "mode": rest.partition("-")[0],
        "role": "train",
        "model": "",
        "shape": "",
    }
    read = _readable(folder / MANIFEST)
    found = _salvaged(facts | read)
    return found if found.asked is not None else _salvaged(facts | {"mode": "hop"})


def _readable(path: Path) -> dict[str, Any]:
    """Return the keys of a manifest that can be read."""
    if foreign(path) is not None:
        return {}
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    found: dict[str, Any] = {}
    for block in _KEY.split(text.rstrip().removesuffix("}"))[1:]:
        try:
            found |= json.loads(f"{{{block.rstrip().removesuffix(',')}}}")
        except (ValueError, RecursionError):
            continue
    return found


def _salvaged(facts: Mapping[str, Any]) -> Manifest:
    """Return a manifest of the valid facts; a section without one that it needs is omitted."""
    sections, head = split(facts)
    found = {name: _valid(SECTIONS[name], values) for name, values in sections.items()}
    whole = {
        name: section
        for name, section in found.items()
        if all(
            key in section.model_fields_set or not field.is_required()
            for key, field in SECTIONS[name].model_fields.items()
        )
    }
    return _valid(Manifest, head).model_copy(update=whole)


_ModelT = TypeVar("_ModelT", bound=BaseModel)


def _valid(kind: type[_ModelT], facts: Mapping[str, Any]) -> _ModelT:
    """Return a model of the facts that are valid, each on its own."""
    good: dict[str, Any] = {}
    for key, field in kind.model_fields.items():
        name, annotation = field.alias or key, cast("Any", field.annotation)
        with suppress(KeyError, ValidationError):
            good[name] = TypeAdapter(annotation).validate_python(facts[name])
    return kind.model_construct(**good)


def _created(name: str) -> str:
    """Return the time in a folder's name as ISO 8601."""
    if not NAMED.match(name):
        return ""
    day, clock = name[:10], name[11:17]
    return f"{day}T{clock[:2]}:{clock[2:4]}:{clock[4:6]}"
