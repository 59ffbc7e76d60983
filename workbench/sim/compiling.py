"""Machine code that MuJoCo calls, compiled once for a computer.

numba keeps compiled functions on disk and compiles anew when their own file changes. It does not
see a change in what they call or in the constants of other files, nor in MuJoCo's layout, whose
offsets are built in. So all of that goes into the name under which the code is kept.
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
"""Held while callbacks are compiled and installed: a batch builds robots on several threads."""

F = TypeVar("F", bound=Callable[..., Any])

_SOURCES = sorted(Path(__file__).parent.glob("*.py"))


def callback(function: Callable[..., Any], signature: str, offsets: Sequence[int] = ()) -> CFunc:
    """Compile a function for MuJoCo to call, or take it as it was compiled before.

    Args:
        function: in numba's subset of Python; may call compiled functions of this room.
        signature: as numba writes it.
        offsets: that are built into the code.
    """
    _name_by_sources(function, offsets)
    return numba.cfunc(signature, cache=True)(function)


def compiled(function: F) -> F:
    """Compile a function that calls others of this room; it lets other threads run meanwhile."""
    _name_by_sources(function)
    return cast(F, numba.njit(nogil=True, cache=True, error_model="numpy")(function))


def _name_by_sources(function: Callable[..., Any], offsets: Sequence[int] = ()) -> None:
    digest = hashlib.sha256(repr(tuple(offsets)).encode())
    for source in _SOURCES:
        digest.update(source.read_bytes())
    function.__qualname__ = f"{function.__name__}-{digest.hexdigest()[:16]}"
