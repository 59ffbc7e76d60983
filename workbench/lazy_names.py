"""Names of a room that are loaded when they are first used: who needs one does not load all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import Any

__all__ = ["lazy_names"]


def lazy_names(room: str, files: Mapping[str, Iterable[str]]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a room's `__init__`.

    A name is looked up in its file each time, so that no file may bear the name of what it exports.

    Args:
        room: the module's name.
        files: module below the room -> names that it defines.
    """
    where = {name: file for file, names in files.items() for name in names}

    def load(name: str) -> Any:
        if name in where:
            return getattr(import_module(f"{room}.{where[name]}"), name)
        near = import_module("workbench.errors").did_you_mean(name, sorted(where))
        raise AttributeError(f"module {room!r} has no attribute {name!r}{near}")

    return load
