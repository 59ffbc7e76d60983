"""What of a damaged manifest can still be read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from workbench.bundle.inside import foreign
from workbench.bundle.names import MANIFEST, NAMED

__all__ = ["recovered_manifest"]

_KEY = re.compile(r'\n(?=  ")')  # a manifest has one key of its own a line, indented by two


def recovered_manifest(folder: Path) -> dict[str, Any]:
    """Return the keys of a manifest that can be read, and what the folder's name tells of the rest.

    There are always `id`, `status`, `created`, `title`, `mode`, `role` and `versions`, so that
    whoever shows the run needs no care; what nobody knows is empty.
    """
    rest = NAMED.sub("", folder.name)
    told = {
        "id": folder.name,
        "status": "failed",
        "created": _created(folder.name),
        "title": rest or folder.name,
        "mode": rest.partition("-")[0],
        "role": "",
        "versions": {},
    }
    if foreign(folder / MANIFEST) is not None:
        return told
    try:
        text = (folder / MANIFEST).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return told
    for block in _KEY.split(text.rstrip().removesuffix("}"))[1:]:
        try:
            told |= json.loads(f"{{{block.rstrip().removesuffix(',')}}}")
        except (ValueError, RecursionError):
            continue
    return told


def _created(name: str) -> str:
    """Return the time in a folder's name as ISO 8601."""
    if not NAMED.match(name):
        return ""
    day, clock = name[:10], name[11:17]
    return f"{day}T{clock[:2]}:{clock[2:4]}:{clock[4:6]}"
