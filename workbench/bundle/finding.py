"""From what a person types to the folder of a bundle."""

from __future__ import annotations

import os
from pathlib import Path

from workbench.bundle.names import MANIFEST, NAMED
from workbench.errors import InputError, did_you_mean

__all__ = ["bundle_names", "find_folder", "is_run", "no_bundle"]

_TOLD = 8  # candidates that a message names


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


def find_folder(run: Path, root: Path) -> Path:
    """Return the folder of the bundle that is meant.

    Args:
        run: its path, its name, its number in `runs list`, or a part of the name that only one has.
        root: folder of all bundles.

    Raises:
        InputError: when none fits, or several do; they are named.
    """
    if run.exists():
        return run
    names, wanted = bundle_names(root), str(run)
    if wanted in names:
        return root / wanted
    if wanted.isdecimal():
        if 1 <= int(wanted) <= len(names):
            return root / names[int(wanted) - 1]
        raise InputError(f"run {wanted}: {root} holds {len(names)} runs, numbered from 1")
    fitting = [name for name in names if wanted.casefold() in name.casefold()]
    if len(fitting) == 1:
        return root / fitting[0]
    if fitting:
        more = f" and {len(fitting) - _TOLD} older ones" if len(fitting) > _TOLD else ""
        newest = ", ".join(fitting[: -_TOLD - 1 : -1])
        raise InputError(
            f"{wanted!r} fits {len(fitting)} runs in {root}: {newest}{more}; type more of the "
            "name, or its number in `workbench runs list`"
        )
    guess = did_you_mean(wanted, names)
    raise InputError(
        f"{wanted}: no such run; {root} holds {len(names)} runs, see `workbench runs list`{guess}"
    )


def is_run(path: Path) -> bool:
    """Tell whether a folder is a run's, by its manifest or, where that was lost, by its name."""
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
