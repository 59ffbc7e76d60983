"""Whether a bundle changed since somebody looked: cheap enough for ten thousand of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from workbench.bundle.names import CHECKSUMS, MANIFEST, REMARKS

__all__ = ["Stamp", "stamping"]


Stamp = tuple[int, int, int, int, int, int]
"""Time of change [ns], size [byte] and number of the manifest's file, time and size of the remarks,
and 1 where there are checksums. Zeros mean a file that is not there."""


@contextmanager
def stamping(root: Path) -> Iterator[Callable[[str, bool], Stamp]]:
    """Give a function from a bundle's name to what changes when its manifest or remarks do.

    The caller also says whether checksums were there before: they do not vanish, so need no look.

    Args:
        root: folder of the bundles. Where the system can, it is opened once: every look starts from
            there and does not walk the path anew, which is a third of its time.
    """
    if os.stat not in os.supports_dir_fd or os.access not in os.supports_dir_fd:
        yield lambda name, closed: _stamp(f"{root}/{name}", closed, None)
        return
    handle = os.open(root, os.O_RDONLY)
    try:
        yield lambda name, closed: _stamp(name, closed, handle)
    finally:
        os.close(handle)


def _stamp(folder: str, closed: bool, root: int | None) -> Stamp:
    """Return the stamp; the folder is a text, for making a `Path` costs more than the look."""
    changed, size, file = _seen(f"{folder}/{MANIFEST}", root)
    remarks = f"{folder}/{REMARKS}"
    # most have none, and an exception costs more than to ask first
    said, length, _ = _seen(remarks, root) if _exists(remarks, root) else (0, 0, 0)
    sealed = 1 if closed else int(_exists(f"{folder}/{CHECKSUMS}", root))
    return changed, size, file, said, length, sealed


def _exists(path: str, root: int | None) -> bool:
    return os.access(path, os.F_OK, dir_fd=root)


def _seen(path: str, root: int | None) -> tuple[int, int, int]:
    try:
        found = os.stat(path, dir_fd=root)
    except OSError:
        return 0, 0, 0
    return found.st_mtime_ns, found.st_size, found.st_ino
