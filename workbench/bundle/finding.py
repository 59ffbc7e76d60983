"""Which folders are bundles."""

from __future__ import annotations

import os
from pathlib import Path

from workbench.bundle.names import MANIFEST, NAMED

__all__ = ["bundle_names", "is_run", "no_bundle"]


def bundle_names(root: Path) -> list[str]:
    """Return the names of the bundles in a folder, oldest first; the first is number 1.

    A folder counts by its manifest; one whose manifest is lost counts by its name.

    Args:
        root: folder of all bundles; one that does not exist has none.
    """
    try:
        with os.scandir(root) as entries:
            names = [one.name for one in entries if one.is_dir()]
    except (FileNotFoundError, NotADirectoryError):
        return []
    found = [n for n in names if NAMED.match(n) or os.path.exists(f"{root}/{n}/{MANIFEST}")]
    return sorted(found)


def is_run(path: Path) -> bool:
    """Return whether a folder is a run's, by its manifest or, where that was lost, by its name."""
    return path.is_dir() and bool(NAMED.match(path.name) or (path / MANIFEST).exists())


def no_bundle(path: Path) -> str:
    """Return what a place is that holds no manifest, and what was perhaps meant."""
    if path.is_file():
        return "a file, not a bundle; name the folder of a run"
    hint = f"; did you mean {path.parent}?" if (path.parent / MANIFEST).exists() else ""
    return (
        f"not a bundle, it has no {MANIFEST}{hint}; name the folder of a run, "
        "`workbench runs list` shows them"
    )
