"""What a room exports: the names that its `__init__` imports, each written there once.

A name imported under `TYPE_CHECKING` is loaded when it is first used: who needs one loads not all.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

__all__ = ["exports"]

_IMPORT = re.compile(r"^ *from (workbench\.[\w.]+) import (\([^)]*\)|.*)$", re.MULTILINE)


def exports(room: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a room.

    A name is looked up in its file each time, so that no file may bear the name of what is loaded
    so.

    Args:
        room: the module's name.
    """
    with open(str(sys.modules[room].__file__), encoding="utf-8") as file:
        imports = _IMPORT.findall(file.read())
    where = {
        name: module
        for module, names in imports
        if module != __name__
        for name in re.findall(r"\w+", names)
    }

    def load(name: str) -> Any:
        if name in where:
            return getattr(import_module(where[name]), name)
        near = import_module("workbench.errors").did_you_mean(name, sorted(where))
        raise AttributeError(f"module {room!r} has no attribute {name!r}{near}")

    names = sorted(where)
    return load, names.copy, names
