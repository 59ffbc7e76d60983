"""The bulk reader answers for plain files, and leaves everything else to the careful one."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from fuzzing import FLAVOURS, base_export, check
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.tracking import (
    BodyTake,
    Cloud,
    SampleStatus,
    Take,
    read_take,
    write_motive,
    write_row,
)
from workbench.tracking.csv_columns import CsvColumns, find_rows, read_columns
from workbench.tracking.motive_header import read_layout
from workbench.tracking.motive_table import read_bulk as motive_bulk
from workbench.tracking.row_bulk import read_bulk as row_bulk
from workbench.tracking.row_table import version_of
from workbench.tracking.source import LARGE, Source

Edit = Callable[[bytes], bytes]


def answers(data: bytes) -> bool:
    """Tell whether the bulk reader reads a file."""
    source = Source("x.csv", str, data)
    if data.startswith((b"Format", b"\xef\xbb\xbfFormat")):
        return motive_bulk(read_layout(source), source) is not None
    return row_bulk(source, version_of(source)) is not None


@pytest.mark.budget(25)  # compiles the reader where no cache is kept
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_our_own_exports_are_read_in_bulk(flavour: str, stored: Path, tmp_path: Path) -> None:
    data = (stored / f"hop_{flavour}.csv").read_bytes()
    for same in (data, data.replace(b"\r\n", b"\n"), b"\xef\xbb\xbf" + data):
        assert answers(same)
        assert check(tmp_path / "x.csv", same)[1] == []


def test_real_exports_are_read_in_bulk(real_exports: Path, tmp_path: Path) -> None:
    files = sorted(real_exports.glob("*.csv"))
    assert len(files) == 3
    for file in files:
        assert answers(file.read_bytes())
        assert check(tmp_path / "x.csv", file.read_bytes())[1] == []


@pytest.mark.parametrize(
    ("flavour", "edit"),
    [
        ("row_1.0", lambda s: s.replace(b'"Foot"', b'"Foot, left"')),
        ("row_1.0", lambda s: s.replace(b'"Foot"', b'"Fo""ot"')),
        ("row_1.0", lambda s: s.replace(b"\r\n", b",,\r\n")),
        ("row_1.0", lambda s: s.replace(b"frame,3,", b"FRAME,3,")),
        ("row_1.0", lambda s: s.replace(b"comment,", b'comment,"a\nb",', 1)),
        ("row_1.1", lambda s: s.replace(b",NAN", b",-inf", 1)),
        ("motive_1.23", lambda s: s.replace(b"\r\n", b",,\r\n")),
        ("motive_1.23", lambda s: s.replace(b"0.008333,", b'"0.008333",')),
        ("motive_1.23", lambda s: s.replace(b"0.008333,", b"0.008_333,")),
        ("motive_1.23", lambda s: s.replace(b"0.008333,", b"inf,")),
    ],
)
def test_what_is_not_plain_is_declined_and_read_all_the_same(
    flavour: str, edit: Edit, stored: Path, tmp_path: Path
) -> None:
    data = (stored / f"hop_{flavour}.csv").read_bytes()
    assert edit(data) != data
    assert not answers(edit(data))
    found, faults = check(tmp_path / "x.csv", edit(data))
    assert isinstance(found, Take)
    assert faults == []


@pytest.mark.parametrize("blank", [b"nan", b"-1.#INF", b"1.#QNAN", b""])
def test_any_blank_is_read_in_bulk(blank: bytes, stored: Path, tmp_path: Path) -> None:
    data = (stored / "hop_row_1.1.csv").read_bytes()
    edited = data.replace(b",NAN", b"," + blank, 1)
    assert edited != data
    assert answers(edited)
    assert check(tmp_path / "x.csv", edited)[1] == []


def test_a_blank_last_cell_is_left_to_the_careful_reader(stored: Path, tmp_path: Path) -> None:
    lines = (stored / "hop_row_1.0.csv").read_bytes().split(b"\r\n")
    lines[-2] = lines[-2][: lines[-2].rindex(b",") + 1]
    text = b"\r\n".join(lines)
    assert not answers(text)
    found, faults = check(tmp_path / "x.csv", text)
    assert faults == []
    assert "has 23 cells and 2 markers; 24 cells" in str(found)


def rectangle(
    text: bytes, width: int, numbers: Sequence[int], words: Sequence[int] = ()
) -> CsvColumns | None:
    return read_columns(find_rows(text, 0), width, numbers, words)


@pytest.mark.parametrize(
    "text",
    [b'7,a"b\n', b'7,"a\n', b'"7",a\n', b"7\n", b"7,a,\n", b"7,a\r8,b\n", b"7,a\r", b"inf,a\n"],
)
def test_a_row_that_is_not_plain_is_declined(text: bytes) -> None:
    assert rectangle(b"6,a\n" + text, 2, [0], [1]) is None
    assert rectangle(b"6,a\n" + text, 2, [0]) is None or (b"\r8" not in text and b'"' not in text)


def test_rows_are_put_where_they_are_asked_for_and_words_are_shared() -> None:
    text = b'3,"a",x\n1,b,a\n2,a,b\n'
    found = read_columns(find_rows(text, 0), 3, [0], [1, 2], places=np.array([2, 0, 1]))
    assert found is not None
    assert found.numbers.tolist() == [[1.0, 2.0, 3.0]]
    assert {word: rows.tolist() for word, rows in found.words(0).items()} == {"a": [1, 2], "b": [0]}
    assert {word: rows.tolist() for word, rows in found.words(1).items()} == {
        "x": [2], "a": [0], "b": [1]
    }  # fmt: skip


def test_more_words_and_rows_than_one_block_holds_are_read() -> None:
    texts = [f"{k},label {k % 1000},{0.001 * k:.3f},{k}e-3\r\n" for k in range(150_000)]
    found = rectangle("".join(texts).encode(), 4, [0, 2, 3], [1])  # 4.4 MB; blocks have 2 MB
    assert found is not None
    order = np.arange(150_000)
    assert (found.numbers[0] == order).all()
    assert found.numbers[2].tolist() == [float(f"{k}e-3") for k in order]
    assert tuple(found.vocabulary) == tuple(f"label {k}" for k in range(1000))
    assert (found.codes[0] == order % 1000).all()


def test_small_files_are_read_without_loading_the_compiler(stored: Path) -> None:
    code = (
        "import sys; from workbench.tracking import read_take; read_take(sys.argv[1]); "
        "sys.exit('numba' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code, stored / "hop_motive_1.23.csv"], check=True)


def test_a_large_file_is_read_in_bulk(stored: Path, tmp_path: Path) -> None:
    head, *rows = (stored / "hop_motive_1.23.csv").read_bytes().split(b"\r\n0,")
    row = rows[0].split(b"\r\n")[0]
    count = LARGE // len(row) + 1
    text = head + b"".join(b"\r\n%d,%s" % (k, row) for k in range(count)) + b"\r\n"
    with mock.patch("workbench.tracking.motive_table.read_strict") as careful:
        (tmp_path / "x.csv").write_bytes(text)
        assert len(read_take(tmp_path / "x.csv")) == count
    careful.assert_not_called()


CELLS = st.one_of(
    st.floats(allow_nan=False, width=32).map(repr),
    st.decimals(-1000, 1000, allow_nan=False).map(lambda x: f"{x:f}"),
    st.sampled_from(
        ["", "NAN", "nan", "-0.0", "1e9", "1.5e9", "1_0", " 1", "1.", ".5", "0x1", "#"]
    ),
    st.text(alphabet='0123456789.-+eE "', max_size=5),
)


@settings(max_examples=300, deadline=None)
@given(rows=st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=5))
def test_a_number_read_in_bulk_is_the_one_that_python_reads(rows: list[tuple[str, str]]) -> None:
    text = "".join(f"7,{a},{b}\n" for a, b in rows)
    found = rectangle(text.encode(), 3, [1, 2])
    if found is not None:
        careful = [Source("x", str, b"").numbers(row, 1, (0, 1)) for row in rows]
        np.testing.assert_array_equal(found.numbers, np.array(careful).T)


@st.composite
def any_take(draw: st.DrawFn) -> Take:
    """Return a take of one to six frames with zero to three bodies, some frames dark."""
    n = draw(st.integers(1, 6))
    values = np.random.default_rng(draw(st.integers(0, 99))).normal(size=(4, n, 4, 3))
    bodies: dict[str, BodyTake] = {}
    for number, name in enumerate(draw(st.lists(st.sampled_from("ABC"), unique=True))):
        m = draw(st.integers(1, 4))
        lost = np.array(draw(st.lists(st.booleans(), min_size=n, max_size=n)))
        bits = st.lists(st.booleans(), min_size=n * m, max_size=n * m)
        shown = np.array(draw(bits)).reshape(n, m) & ~lost[:, None]
        places = values[number, :, :m]
        bodies[name] = BodyTake(
            name=name,
            id=str(number + 1),
            position=np.where(lost[:, None], np.nan, places[:, 0]),
            quaternion=np.where(lost[:, None], np.nan, [1.0, 0.0, 0.0, 0.0]),
            measured=np.where(shown[:, :, None], places, np.nan),
            solved=places,
            marker_names=tuple(f"Marker {k + 1}" for k in range(m)),
            missing=np.where(lost, SampleStatus.LOST, SampleStatus.SEEN).astype(np.int8),
        )
    loose = np.array(draw(st.lists(st.booleans(), min_size=2 * n, max_size=2 * n))).reshape(n, 2)
    points = np.where(loose[:, :, None], values[3, :, :2], np.nan)
    names = np.where(loose, [["Unlabeled 7", "Unlabeled 9"]], "").astype(object)
    times = np.arange(n) / 120
    return Take(
        path="", sha256="", format="row", version="1.0", rate_hz=120.0, jitter_s=0.0,
        indices=np.arange(n), times=times, bodies=bodies, cloud=Cloud(points, names),
    )  # fmt: skip


@settings(max_examples=150, deadline=None)
@given(
    take=any_take(), version=st.sampled_from(["row 1.0", "row 1.1", "motive 1.21", "motive 1.24"])
)
def test_any_take_is_read_in_bulk_as_row_by_row(
    take: Take, version: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    kind, number = version.split()
    write = write_row if kind == "row" else write_motive
    write(take, path, number)  # type: ignore[arg-type]
    text = path.read_bytes()
    found, faults = check(path, text)
    assert faults == []
    if isinstance(found, str):
        empty = "there are no data columns|no marker is ever seen|no rate can be found"
        assert re.search(empty, found)
        return
    assert answers(text)
    assert len(found) == len(take)
    for name, body in take.bodies.items():
        np.testing.assert_allclose(found.bodies[name].measured, body.measured, atol=1e-6)
        if kind == "row":  # in Motive files a pose without a raw marker does not count
            assert found.bodies[name].seen.tolist() == body.seen.tolist()


def test_the_stored_exports_are_those_that_are_fuzzed() -> None:
    assert all(len(base_export(flavour).frames) == 12 for flavour in FLAVOURS)
