"""Whether a bundle changed since somebody looked: cheap enough for ten thousand of them."""

from __future__ import annotations

import os
from typing import NamedTuple

from workbench.bundle.names import CHECKSUMS, MANIFEST, REMARKS

__all__ = ["Stamp", "stamp"]


class Stamp(NamedTuple):
    """What changes when a bundle's manifest or remarks do.

    Args:
        manifest: time of change [ns], size [byte] and number of the file; empty without one.
        remarks: the same of the remarks.
        closed: whether checksums are there; 0 where nobody looked.
    """

    manifest: str
    remarks: str
    closed: int


def stamp(folder: str, closed: bool) -> Stamp:
    """Return the stamp of a bundle.

    Args:
        folder: its path; a text, for making a `Path` costs more than the look.
        closed: whether checksums were there before: they do not vanish, and need no new look.
    """
    return Stamp(
        _seen(f"{folder}/{MANIFEST}"),
        _seen(f"{folder}/{REMARKS}"),
        1 if closed else int(os.path.exists(f"{folder}/{CHECKSUMS}")),
    )


def _seen(path: str) -> str:
    try:
        found = os.stat(path)
    except OSError:
        return ""
    return f"{found.st_mtime_ns} {found.st_size} {found.st_ino}"
