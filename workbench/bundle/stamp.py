"""Whether a bundle changed since somebody looked: cheap enough for ten thousand of them."""

from __future__ import annotations

import os

from workbench.bundle.names import CHECKSUMS, MANIFEST, REMARKS

__all__ = ["Stamp", "stamp"]


Stamp = tuple[int, int, int, int, int, int]
"""Time of change [ns], size [byte] and number of the manifest's file, time and size of the remarks,
and 1 where there are checksums. Zeros stand for a file that is not there."""


def stamp(folder: str, closed: bool) -> Stamp:
    """Return what changes when a bundle's manifest or remarks do.

    Args:
        folder: its path; a text, for making a `Path` costs more than the look.
        closed: whether checksums were there before: they do not vanish, and need no new look.
    """
    changed, size, file = _seen(f"{folder}/{MANIFEST}")
    said, length, _ = _seen(f"{folder}/{REMARKS}")
    sealed = 1 if closed else int(os.path.exists(f"{folder}/{CHECKSUMS}"))
    return changed, size, file, said, length, sealed


def _seen(path: str) -> tuple[int, int, int]:
    try:
        found = os.stat(path)
    except OSError:
        return 0, 0, 0
    return found.st_mtime_ns, found.st_size, found.st_ino
