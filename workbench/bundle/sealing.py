"""The checksums of a finished bundle: written, and compared with what is there."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection
from pathlib import Path

from workbench.bundle.inside import contents, foreign
from workbench.bundle.names import CHECKSUMS, REMARKS, VIEWS
from workbench.bundle.writing import replaced

__all__ = ["against_checksums", "seal", "sealed_files", "sha256"]

_ENTRY = re.compile(r"([0-9a-f]{64})  (.+)")  # as sha256sum writes and checks it
_UNSURE = f"not as {CHECKSUMS} has it, which was changed itself"
_GROWS = "# still written when the run ended: "
_LIST_DIGEST = "# sha256 of the lines above: "  # a comment to sha256sum
_UNSEALED = {*VIEWS.values(), *(f".{name}" for name in VIEWS.values())}
"""Views and their drafts: drawn anew at any time. The first bundles' checksums list the views."""


def sha256(path: Path) -> str:
    """Return the hex digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def seal(folder: Path, growing: Collection[str] = ()) -> None:
    """Write the checksums of all that a bundle holds but its views; `sha256sum -c` reads them.

    Args:
        folder: of the bundle.
        growing: names of files that another process still writes; they are named and not sealed.

    Raises:
        RecordError: when they cannot be written.
    """
    files = sealed_files(folder)
    lines = "".join(f"{sha256(file)}  {name}\n" for name, file in files if name not in growing)
    lines += "".join(f"{_GROWS}{name}\n" for name, _ in files if name in growing)
    with replaced(folder / CHECKSUMS) as draft:
        draft.write_text(f"{lines}{_LIST_DIGEST}{_digest(lines)}\n", encoding="utf-8", newline="")


def against_checksums(path: Path) -> list[str]:
    """Return what differs from the checksums of a bundle that has some, one sentence each."""
    if foreign(path / CHECKSUMS) is not None:
        return contents(path).problems
    text = (path / CHECKSUMS).read_bytes().decode("utf-8", errors="replace")
    listed, trusted = text.rpartition(_LIST_DIGEST)[0], _is_as_written(text)
    problems: list[str] = []
    if not trusted:
        problems = [f"{CHECKSUMS}: changed or cut short since the run was finished"]
    inside = contents(path)
    files = dict(_sealed(inside.files))
    problems += inside.problems
    for line in (listed or text).splitlines():
        entry = _ENTRY.fullmatch(line)
        if line.startswith(_GROWS):
            files.pop(line.removeprefix(_GROWS), None)
        if entry is None:
            continue  # the list is not as it was written, which has been reported
        digest, name = entry.groups()
        if name in inside.others or name in _UNSEALED:
            continue  # which has been reported, or may be drawn anew
        file = files.pop(name, None)
        if file is None:
            problems.append(f"{name}: missing")
        elif sha256(file) != digest:
            since = "changed since the run was finished" if trusted else _UNSURE
            problems.append(f"{name}: {since}")
    unknown = files if trusted else {}  # a list that was cut short may well have named them
    return problems + [f"{name}: not in {CHECKSUMS}" for name in unknown]


def _is_as_written(text: str) -> bool:
    """Return whether the checksums end in their own digest; the first bundles' had none yet."""
    listed, mark, digest = text.rpartition(_LIST_DIGEST)
    if mark:
        return digest == f"{_digest(listed)}\n"
    return text.endswith("\n") and all(map(_ENTRY.fullmatch, text.splitlines()))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", errors="replace")).hexdigest()


def sealed_files(folder: Path) -> list[tuple[str, Path]]:
    """Return name and path of each file that checksums are for, in order."""
    return _sealed(contents(folder).files)


def _sealed(files: list[tuple[str, Path]]) -> list[tuple[str, Path]]:
    unsealed = {CHECKSUMS, f".{CHECKSUMS}", REMARKS} | _UNSEALED
    return [(name, file) for name, file in files if name not in unsealed]
