"""Work on several parts at once: compiled loops let other threads run while they compute."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["at_once"]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def at_once(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> Iterator[_Result]:
    """Yield what a function makes of each item, in their order.

    The first error in that order is raised. The function must not change what items share.
    """
    with ThreadPoolExecutor() as pool:
        yield from pool.map(function, items)
