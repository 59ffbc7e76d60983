"""What truly lies in a bundle: plain files, no links, pipes or devices.

A folder that came from elsewhere may hold anything. A link would let its maker read files of
whoever looks at the run, a pipe would hold a reader up for ever; so neither is ever opened.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from workbench.errors import InputError

__all__ = ["Contents", "contents", "foreign", "printable", "require_file", "unportable"]

_MOUNT_POINT = 0xA0000003  # reparse tag of a Windows junction, a link between folders
_KINDS = (
    (stat.S_ISLNK, "a link"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISCHR, "a device"),
)
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|conin\$|conout\$|clock\$|com[0-9¹²³]|lpt[0-9¹²³])")


class Contents(NamedTuple):
    """Everything in a folder, at any depth.

    Args:
        files: name and path of each plain file, in order; names have `/` between folders.
        others: name of whatever else lies there -> what it is.
    """

    files: list[tuple[str, Path]]
    others: dict[str, str]

    @property
    def problems(self) -> list[str]:
        """Return a sentence for each that is no file."""
        return [
            f"{name}: {what}, and no file of the run; it is not opened"
            for name, what in self.others.items()
        ]


def contents(folder: Path) -> Contents:
    """Return what lies in a folder, without leaving it."""
    files: list[tuple[str, Path]] = []
    others: dict[str, str] = {}
    for name, path in _walk(folder, ""):
        what = foreign(path)
        if what is None and printable(name) != name:
            what = "a name with characters that cannot be shown"
        if what is None:
            files.append((name, path))
        else:
            others[printable(name)] = what
    return Contents(sorted(files), dict(sorted(others.items())))


def foreign(path: Path) -> str | None:
    """Return what is at a path in place of a file or folder; None where nothing else does."""
    try:
        found = path.lstat()
    except OSError:
        return None
    if getattr(found, "st_reparse_tag", 0) == _MOUNT_POINT:
        return "a link"
    return next((what for fits, what in _KINDS if fits(found.st_mode)), None)


def require_file(path: Path) -> Path:
    """Return the path of a file of a run, or of none.

    Raises:
        InputError: when something else is there, such as a link.
    """
    if (what := foreign(path)) is not None:
        raise InputError(f"{path}: is {what}, and no file of the run")
    return path


def printable(name: str) -> str:
    """Return a name with every character escaped that no list can show."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in name)


def unportable(name: str) -> str | None:
    """Return why a name would be another file, or one elsewhere, on some system; None if nowhere.

    Args:
        name: of a file, with `/` between folders.
    """
    if printable(name) != name:
        return "its name has characters that cannot be shown"
    for part in name.split("/"):
        if part in ("", ".", ".."):
            return "its name leads out of the folder"
        if found := re.search(r'[\\:*?"<>|]', part):
            return f"its name has a {found[0]}, which Windows takes for something else"
        if part[-1] in ". ":
            return "its name ends in a dot or space, which Windows drops"
        if _RESERVED.fullmatch(part.split(".")[0].rstrip(" ")):
            return "its name is that of a device on Windows"
    return None


def _walk(folder: Path, above: str) -> Iterator[tuple[str, Path]]:
    """Yield name and path of all but the folders, which are entered unless they are links."""
    with os.scandir(folder) as entries:
        found = sorted(entries, key=lambda entry: entry.name)
    for entry in found:
        path, name = Path(entry.path), above + entry.name
        if entry.is_dir(follow_symlinks=False) and foreign(path) is None:
            yield from _walk(path, f"{name}/")
        else:
            yield name, path
