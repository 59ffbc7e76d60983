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
    try:
        found = os.stat(f"{folder}/{MANIFEST}")
        manifest = (found.st_mtime_ns, found.st_size, found.st_ino)
    except OSError:
        manifest = (0, 0, 0)
    try:
        found = os.stat(f"{folder}/{REMARKS}")
        remarks = (found.st_mtime_ns, found.st_size)
    except OSError:
        remarks = (0, 0)
    return (*manifest, *remarks, 1 if closed else int(os.path.exists(f"{folder}/{CHECKSUMS}")))
