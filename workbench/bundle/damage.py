"""What is wrong with a bundle, in sentences that name the file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from workbench.bundle.finding import is_run, no_bundle
from workbench.bundle.folder import Bundle
from workbench.bundle.inside import contents
from workbench.bundle.names import CHECKSUMS, GUARDIAN, JOURNAL, MANIFEST, WIRE
from workbench.bundle.remarks import faults_of_remarks
from workbench.bundle.sealing import against_checksums, sealed_files
from workbench.errors import InputError

__all__ = ["verify"]

_LINES = (JOURNAL, GUARDIAN, WIRE)
_PARQUET_ENDS = b"PAR1"


def verify(path: Path) -> list[str]:
    """Return what is wrong with a bundle's files, one sentence each; empty when all is well.

    Each sentence begins with the name of the file and a colon.

    Raises:
        InputError: when the folder is no bundle.
    """
    if not is_run(path):
        raise InputError(f"{path}: {no_bundle(path)}")
    sealed = (path / CHECKSUMS).exists()
    found = against_checksums(path) if sealed else _cut_off(path)
    return found + faults_of_remarks(path)


def _cut_off(path: Path) -> list[str]:
    """Return what is wrong with a run that was never finished, as far as its files show."""
    bundle, lost = Bundle.recover(path)
    off = f"; {bundle.record.output.description}" if bundle.record.output_off else ""
    text = f"{CHECKSUMS}: missing; the run was cut off (status {bundle.manifest.status}){off}"
    return [text, *([lost] if lost else []), *contents(path).problems, *_torn(path)]


def _torn(path: Path) -> Iterator[str]:
    """Yield what a program that was killed while it wrote leaves behind."""
    for name, file in sealed_files(path):
        if file.name.startswith("."):
            yield f"{name}: a draft that was never finished"
        elif name in _LINES and not _ends(file, b"\n"):
            yield f"{name}: its last line is cut short"
        elif not _is_whole(name, file):
            yield f"{name}: cut short"


def _is_whole(name: str, file: Path) -> bool:
    """Return whether a file whose form shows it has its end."""
    if file.suffix == ".parquet":
        return _ends(file, _PARQUET_ENDS)
    if file.suffix != ".json" or name == MANIFEST:
        return True
    try:
        json.loads(file.read_bytes())
    except ValueError:
        return False
    return True


def _ends(file: Path, end: bytes) -> bool:
    data = file.read_bytes()
    return not data or data.endswith(end)
