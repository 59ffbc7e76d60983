"""Map a function over items on several threads; compiled loops release the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["parallel_map"]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def parallel_map(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> Iterator[_Result]:
    """Yield the results of a function for each item, in their order; raise the first error.

    The function must not change shared data.
    """
    with ThreadPoolExecutor() as pool:
        yield from pool.map(function, items)
