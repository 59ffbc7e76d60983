"""What of a damaged manifest can still be read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from workbench.bundle.inside import foreign
from workbench.bundle.manifest import Manifest
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
    found = Manifest.salvage(facts | read)
    return found if found.asked is not None else Manifest.salvage(facts | {"mode": "hop"})


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


def _created(name: str) -> str:
    """Return the time in a folder's name as ISO 8601."""
    if not NAMED.match(name):
        return ""
    day, clock = name[:10], name[11:17]
    return f"{day}T{clock[:2]}:{clock[2:4]}:{clock[4:6]}"
