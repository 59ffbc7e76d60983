"""Checksums of a finished bundle, and what is wrong with any bundle."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from pathlib import Path

from workbench.bundle.names import CHECKSUMS, JOURNAL, MANIFEST, NAMED, REMARKS
from workbench.bundle.remarks import faults_of_remarks
from workbench.bundle.writing import replaced
from workbench.errors import InputError

__all__ = ["damaged_files", "seal", "sha256", "verify"]

_ENTRY = re.compile(r"([0-9a-f]{64})  (.+)")  # as sha256sum writes and checks it
_OWN = "# sha256 of the lines above: "  # a comment to sha256sum
_LINES = ("journal.jsonl", "guardian.jsonl", "wire.log")
_PARQUET_ENDS = b"PAR1"


def sha256(path: Path) -> str:
    """Return the hex digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def seal(folder: Path) -> None:
    """Write the checksums of all that a bundle holds; `sha256sum -c` reads them too.

    Raises:
        RecordError: when they cannot be written.
    """
    lines = "".join(f"{sha256(file)}  {name}\n" for name, file in _files(folder))
    with replaced(folder / CHECKSUMS) as draft:
        draft.write_text(f"{lines}{_OWN}{_digest(lines)}\n", encoding="utf-8", newline="")


def verify(path: Path) -> list[str]:
    """Return what is wrong with a bundle's files, one sentence each; empty when all is well.

    Each sentence begins with the name of the file and a colon.

    Raises:
        InputError: when the folder is no bundle.
    """
    if not path.is_dir() or not (NAMED.match(path.name) or (path / MANIFEST).exists()):
        raise InputError(f"{path}: not a bundle, it has no {MANIFEST}")
    sealed = (path / CHECKSUMS).exists()
    found = _against_checksums(path) if sealed else _cut_off(path)
    return found + faults_of_remarks(path)


def damaged_files(problems: list[str]) -> frozenset[str]:
    """Return the names of the files that the sentences of `verify` are about."""
    return frozenset(problem.partition(": ")[0] for problem in problems)


def _against_checksums(path: Path) -> list[str]:
    text = (path / CHECKSUMS).read_bytes().decode("utf-8", errors="replace")
    listed, trusted = text.rpartition(_OWN)[0], _is_as_written(text)
    problems: list[str] = []
    if not trusted:
        problems = [f"{CHECKSUMS}: changed or cut short since the run was finished"]
    files = dict(_files(path))
    for line in (listed or text).splitlines():
        entry = _ENTRY.fullmatch(line)
        if entry is None:
            continue  # the list is not as it was written, which has been told
        digest, name = entry.groups()
        file = files.pop(name, None)
        if file is None:
            problems.append(f"{name}: missing")
        elif sha256(file) != digest:
            problems.append(f"{name}: changed since the run was finished")
    unknown = files if trusted else {}  # a list that was cut short may well have named them
    return problems + [f"{name}: not in {CHECKSUMS}" for name in unknown]


def _is_as_written(text: str) -> bool:
    """Tell whether the checksums end in their own digest."""
    listed, mark, own = text.rpartition(_OWN)
    return bool(mark) and own == f"{_digest(listed)}\n"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", errors="replace")).hexdigest()


def _cut_off(path: Path) -> list[str]:
    """Return what is wrong with a run that was never finished, as far as its files can tell."""
    from workbench.bundle.folder import Bundle  # it is sealed here, so it lies above

    try:
        bundle = Bundle.open(path)
    except InputError as error:
        told = str(error).removeprefix(f"{path / MANIFEST}: ")
        what = told if (path / MANIFEST).exists() else "missing"
        return [f"{CHECKSUMS}: missing; the run was cut off", f"{MANIFEST}: {what}", *_torn(path)]
    off = f"; output off: {bundle.output_off}" if bundle.output_off else ""
    status = bundle.manifest["status"]
    told = f"{CHECKSUMS}: missing; the run was cut off (status {status}){off}"
    return [told, *_torn(path)]


def _torn(path: Path) -> Iterator[str]:
    """Yield what a program that was killed while it wrote leaves behind."""
    for name, file in _files(path):
        if file.name.startswith("."):
            yield f"{name}: a draft that was never finished"
        elif name in _LINES and not _ends(file, b"\n"):
            yield f"{name}: its last line is cut short"
        elif file.suffix == ".parquet" and not _ends(file, _PARQUET_ENDS):
            yield f"{name}: cut short"
        elif file.suffix == ".json" and name != MANIFEST and not _is_json(file):
            yield f"{name}: cut short"


def _ends(file: Path, end: bytes) -> bool:
    data = file.read_bytes()
    return not data or data.endswith(end)


def _is_json(file: Path) -> bool:
    try:
        json.loads(file.read_bytes())
    except ValueError:
        return False
    return True


def _files(folder: Path) -> list[tuple[str, Path]]:
    """Return name and path of each file that checksums are for, in order."""
    found = [(f.relative_to(folder).as_posix(), f) for f in folder.rglob("*")]
    own = (CHECKSUMS, f".{CHECKSUMS}", REMARKS)
    return sorted((name, f) for name, f in found if f.is_file() and name not in own)
