"""The room imports no neighbour."""

from __future__ import annotations

import ast
from pathlib import Path

import workbench.tracking as tracking

ALLOWED = {"motion", "noise", "timeseries", "errors", "room_exports", "tracking"}


def test_tracking_imports_only_the_rooms_below() -> None:
    for file in Path(tracking.__path__[0]).glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("workbench."):
                assert (node.module or "").split(".")[1] in ALLOWED, file.name
