"""What the reader takes for an export, and what it says of everything else."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from workbench.errors import TakeError
from workbench.tracking import read_take

Edit = Callable[[bytes], bytes]


def lines_of(data: bytes) -> list[bytes]:
    return data.split(b"\r\n")


def joined(lines: list[bytes]) -> bytes:
    return b"\r\n".join(lines)


def without_columns(data: bytes) -> bytes:
    lines = lines_of(data)
    return joined([*lines[:2], *[b",".join(line.split(b",")[:2]) for line in lines[2:]]])


@pytest.fixture
def refused(tmp_path: Path) -> Callable[[bytes, str], None]:
    """Return a check that a file is refused with words that match, the file's name and a line."""

    def check(data: bytes, match: str) -> None:
        path = tmp_path / "take.csv"
        path.write_bytes(data)
        with pytest.raises(TakeError, match=match) as caught:
            read_take(path)
        assert str(caught.value).startswith(f"{path}:")

    return check


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", r":1: the file is empty \(0 bytes\)"),
        (b"\r\n \r\n", r"the file is empty \(5 bytes\)"),
        (b"PK\x03\x04rest", r"\.xlsx workbook"),
        (b"\xd0\xcf\x11\xe0rest", r"old Excel workbook"),
        (b"\x02\x50" + bytes(600), r"binary data \(starts with 02 50 00"),
        (b"\x1f\x8b\x08", "gzip data"),
        ("Format Version,1.23".encode("utf-16"), "UTF-16 text; save it as UTF-8"),
        (b"TAK\x00\x01\x02", r"binary data \(starts with 54 41 4b 00"),
        (b"PathFileType\t4\t(X/Y/Z)\tx.trc", r":1: this \.trc file has 1 rows; a header of five"),
        (b"Format Version;1.23;Take Name;x", "separated by semicolons"),
        (b"comment;hello", "separated by semicolons"),
        (b"Format Version\t1.23", "separated by tabs"),
        (b"Frame,Time (Seconds),X,Y,Z\r\n0,0,1,2,3", "header rows are missing"),
        (b"0,0.000,1.0,2.0,3.0\r\n1,0.008,1,2,3", "header rows are missing"),
        (b"hello,world", "the first cell is 'hello', which starts no known export"),
        (b"Format Version,1.23\r\n\r\n", "without the row that starts with 'Frame'"),
        (b"Format Version,1.23\r\n\r\nFrame,Time\r\n", "0 header rows are above 'Frame'"),
        (b"Format Version,1.23\r\n\r\n0,0.1,2\r\n", ":3: data begin without the header row"),
        (b"comment,x\r\ninfo,framecount,0\r\n", "there is no row 'frame'"),
        (b"comment,x\r\nnonsense,1\r\n", ":2: a row starts with 'nonsense'"),
        (b"frame,0,0.0,0,0\r\nframe,1,0.1,0,0\r\n", "there are no rigid bodies"),
    ],
)
def test_what_is_no_export_is_named(
    data: bytes, match: str, refused: Callable[[bytes, str], None]
) -> None:
    refused(data, match)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(TakeError, match=r"gone\.csv: cannot be read"):
        read_take(tmp_path / "gone.csv")
    with pytest.raises(TakeError, match="cannot be read"):
        read_take(tmp_path)


@pytest.mark.parametrize(
    ("file", "edit", "match"),
    [
        ("motive_1.23", lambda s: s[:-300], r":\d+: the row is cut short: \d+ cells"),
        ("row_1.0", lambda s: s[:-60], r":\d+: the row of 'Rotor' has \d+ cells"),
        ("row_1.1", lambda s: s[: s.rindex(b"\nframe") + 60], "the frame row is cut short"),
        (
            "motive_1.21",
            lambda s: s.replace(b"0.008333,0.0", b"0.008333,abc", 1),
            r":9: column \d+ holds 'abc\d*' where a number belongs",
        ),
        (
            "row_1.0",
            lambda s: s.replace(b"0.22000000", b"O.22", 1),
            r"holds 'O\.22' where a number belongs",
        ),
        ("motive_1.23", lambda s: s.replace(b"0.008333,", b'"0,008333",', 1), "decimal comma"),
        (
            "motive_1.23",
            lambda s: s.replace(b"Length Units,Millimeters", b"Length Units,Cubits"),
            "Length Units is 'Cubits'; known are meters",
        ),
        (
            "motive_1.23",
            lambda s: re.sub(rb"(?<=,)(Rigid Body Marker|Rigid Body|Marker)(?=[,\r])", b"Lens", s),
            ":7: there are no data columns; the export is empty; the columns are of type Lens",
        ),
        ("motive_1.23", without_columns, "there are no data columns"),
        ("motive_1.23", lambda s: joined(lines_of(s)[:7]), "no data rows follow"),
        (
            "motive_1.23",
            lambda s: s.replace(b"\r\n5,", b"\r\n5.5,"),
            "the frame index is 5.5, not a whole number",
        ),
        ("row_1.0", lambda s: s.replace(b"frame,7,", b"frame,x,"), "the frame index is 'x'"),
        (
            "row_1.0",
            lambda s: s.replace(b'"Foot",1,0,4', b'"Foot",1,0,3', 1),
            "has 40 cells and 3 markers; 32 cells",
        ),
    ],
)
def test_a_damaged_export_is_refused_with_line_and_cause(
    file: str, edit: Edit, match: str, stored: Path, refused: Callable[[bytes, str], None]
) -> None:
    data = (stored / f"hop_{file}.csv").read_bytes()
    edited = edit(data)
    assert edited != data
    refused(edited, match)


def test_the_width_of_the_rows_tells_the_version(stored: Path, tmp_path: Path) -> None:
    data = (stored / "hop_row_1.1.csv").read_bytes()
    (tmp_path / "x.csv").write_bytes(data.replace(b"info,version,1.1", b"info,version,3.0"))
    take = read_take(tmp_path / "x.csv")
    assert take.version == "1.1"
    assert take.warnings == ("the file says version '3.0', its rows are of 1.1",)


def test_the_name_of_the_file_decides_nothing(stored: Path, tmp_path: Path) -> None:
    (tmp_path / "a.c3d").write_bytes((stored / "hop_row_1.1.csv").read_bytes())
    assert read_take(tmp_path / "a.c3d").format == "row"


def test_start_times_in_any_language_do_not_stop_the_reader(stored: Path, tmp_path: Path) -> None:
    data = (stored / "hop_motive_1.23.csv").read_bytes()
    for word, codec in (("DU.", "utf-8"), ("下午", "utf-8"), ("下午", "gbk"), ("", "utf-8")):
        (tmp_path / "x.csv").write_bytes(data.replace(b"000 PM", b"000 " + word.encode(codec)))
        take = read_take(tmp_path / "x.csv")
        assert take.header["Capture Start Time"].startswith("2012-05-23 12.00.00.000")
        assert len(take.warnings) == (codec == "gbk")
    (tmp_path / "x.csv").write_bytes(b"\xef\xbb\xbf" + data.replace(b"000 PM", b"000 \xff"))
    assert read_take(tmp_path / "x.csv").version == "1.23"


def test_the_take_carries_the_hash_of_its_file(stored: Path) -> None:
    for file in ("hop_row_1.0.csv", "hop_motive_1.23.csv"):
        told = hashlib.sha256((stored / file).read_bytes()).hexdigest()
        assert read_take(stored / file).sha256 == told


def test_a_file_is_read_and_hashed_part_by_part(
    stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = stored / "hop_motive_1.23.csv"
    monkeypatch.setattr("workbench.tracking.reader._BLOCK", 1000)  # bytes
    take = read_take(path)
    assert len(take) == 40
    assert take.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
