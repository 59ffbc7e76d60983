"""Read one export file of any format, which its content determines, not the file's name."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from workbench.errors import TakeError, what_to_do
from workbench.tracking.c3d import is_c3d, parse_c3d
from workbench.tracking.checks import checked
from workbench.tracking.motive import parse_motive
from workbench.tracking.motive_header import is_number
from workbench.tracking.row_format import parse_row
from workbench.tracking.source import Source, shown
from workbench.tracking.take import Take
from workbench.tracking.trc import is_trc, parse_trc

__all__ = ["read_take"]

_READABLE = (
    "readable are OptiTrack exports: CSV of Motive 1.2 to 1.25, CSV of row format 1.0 and 1.1, "
    "C3D, TRC"
)
_BLOCK = 1 << 22  # bytes
_MAGIC = {
    b"PK\x03\x04": "a zip archive or an .xlsx workbook; save the sheet as CSV or export again",
    b"PK\x05\x06": "an empty zip archive",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls); save the sheet as CSV or export again",
    b"\x1f\x8b": "gzip data; unpack it first",
    b"\xff\xfe": "UTF-16 text; save it as UTF-8",
    b"\xfe\xff": "UTF-16 text; save it as UTF-8",
    b"%PDF": "a PDF",
}
_ROW_WORDS = ("comment", "info", "trackable", "rigidbody", "righthanded", "lefthanded", "frame")


def read_take(path: str | Path) -> Take:
    """Read an OptiTrack export.

    Args:
        path: the file; it is never modified.

    Returns:
        The take: metres, seconds, quaternions w, x, y, z, the file's own axes.

    Raises:
        TakeError: the file cannot be used; the message names file, line and cause.
    """
    digest = hashlib.sha256()
    with ThreadPoolExecutor(1) as beside:
        data = _bytes(Path(path), lambda part: beside.submit(digest.update, part))
        return checked(_parsed(str(path), beside.submit(digest.hexdigest).result, data))


def _bytes(path: Path, hashed: Callable[[memoryview], object]) -> memoryview:
    """Return the bytes of a file; each part is passed to `hashed` as soon as it is read."""
    size = 0
    try:
        with path.open("rb", buffering=0) as raw:
            file = raw if raw.seekable() else io.BytesIO(raw.readall())
            # into large pages, which numpy asks for: small ones take longer than reading
            data = np.empty(file.seek(0, io.SEEK_END), np.uint8).data
            file.seek(0)
            while count := file.readinto(data[size : size + _BLOCK]):
                hashed(data[size : size + count])
                size += count
    except OSError as error:
        raise TakeError(f"{path}: cannot be read: {what_to_do(error)}") from error
    except ValueError as error:
        raise TakeError(f"{path}: cannot be read: {error}") from error
    if re.fullmatch(rb"\s*", data[:size]):
        raise TakeError(f"{path}:1: the file is empty ({size} bytes); {_READABLE}")
    return data[:size]


def _parsed(path: str, sha256: Callable[[], str], data: memoryview) -> Take:
    if is_c3d(data):
        return parse_c3d(Source(path, sha256, data))
    _refuse_binary(bytes(data[:1024]), path)
    encoding, warnings = _encoding(data)
    if data[-1] not in b"\n\r":
        warnings.append(
            "the last row has no line end; if the file was cut off, so is its last number"
        )
    source = Source(path, sha256, data, encoding, warnings)
    return parse_trc(source) if is_trc(data) else _parser(source)(source)


def _refuse_binary(head: bytes, path: str) -> None:
    for magic, what in _MAGIC.items():
        if head.startswith(magic):
            raise TakeError(f"{path}:1: this is {what}; {_READABLE}")
    if b"\0" in head:
        raise TakeError(
            f"{path}:1: binary data (starts with {head[:8].hex(' ')}); {_READABLE}; "
            "a .tak file needs an export from Motive: File, Export Tracking Data, or its Batch "
            "Processor for many; elsewhere optitrack-motive-file-converter does it on Windows"
        )


def _encoding(data: memoryview) -> tuple[str, list[str]]:
    """Return the encoding; a start time in another PC's code page must not stop the reader."""
    if np.frombuffer(data, np.int8).min() >= 0:
        return "utf-8-sig", []
    try:
        str(data, "utf-8-sig")
    except UnicodeDecodeError as error:
        return "latin-1", [f"byte {error.start} is not UTF-8; the text is read as Latin-1"]
    return "utf-8-sig", []


def _parser(source: Source) -> Callable[[Source], Take]:
    line, cells = next(source.rows(), (1, [""]))
    first = cells[0].strip()
    if first.casefold() == "format version":
        return parse_motive
    if first.casefold() in _ROW_WORDS and not _time_follows(cells):
        return parse_row
    raise source.fault(line, f"{_diagnosis(first, cells)}; {_READABLE}")


def _time_follows(cells: list[str]) -> bool:
    return len(cells) > 1 and cells[1].strip().casefold().startswith("time")


def _diagnosis(first: str, cells: list[str]) -> str:
    """Describe the first row of a file that is no known export."""
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if separator in first and first.split(separator)[0].strip().casefold() in (
            "format version",
            *_ROW_WORDS,
        ):
            return (
                f"cells are separated by {name}, as a spreadsheet writes them (often with decimal "
                "commas); export from Motive again, or save with commas and decimal points"
            )
    if _time_follows(cells) or (len(cells) > 2 and all(is_number(cell) for cell in cells[:3])):
        return (
            "the header rows are missing (switched off in the exporter?), so units and bodies "
            "are unknown; export again with the header"
        )
    return f"the first cell is {shown(first)}, which starts no known export"
