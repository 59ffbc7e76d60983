"""Callbacks and loops compiled by numba and cached on disk.

numba compiles a cached function anew when its own file changes. It does not notice a change in the
functions that it calls, in constants of other files, or in MuJoCo's layout, whose offsets are
constants. So the name of a cached function contains a hash of all of them.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.ccallback import CFunc

__all__ = ["INSTALLING", "callback", "compiled"]

INSTALLING = threading.Lock()
"""Locked while callbacks are compiled and installed: a batch builds robots on several threads."""

F = TypeVar("F", bound=Callable[..., Any])

_SOURCES = sorted(Path(__file__).parent.glob("*.py"))


def callback(function: Callable[..., Any], signature: str, offsets: Sequence[int] = ()) -> CFunc:
    """Compile a function for MuJoCo to call, or load it from the cache.

    Args:
        function: in numba's subset of Python; may call compiled functions of this room.
        signature: in numba's notation.
        offsets: that are constants of the code.
    """
    _name_by_sources(function, offsets)
    return numba.cfunc(signature, cache=True)(function)


def compiled(function: F) -> F:
    """Compile a function that calls others of this room, without the interpreter's lock."""
    _name_by_sources(function)
    return cast(F, numba.njit(nogil=True, cache=True, error_model="numpy")(function))


def _name_by_sources(function: Callable[..., Any], offsets: Sequence[int] = ()) -> None:
    digest = hashlib.sha256(repr(tuple(offsets)).encode())
    for source in _SOURCES:
        digest.update(source.read_bytes())
    function.__qualname__ = f"{function.__name__}-{digest.hexdigest()[:16]}"
