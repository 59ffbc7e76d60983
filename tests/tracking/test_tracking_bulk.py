"""The bulk reader answers for plain files, and leaves everything else to the careful one."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fuzzing import FLAVOURS, base_export, check
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.tracking import BodyTake, Cloud, Missing, Take, write_motive, write_row
from workbench.tracking.motive_header import read_layout
from workbench.tracking.motive_table import read_bulk as motive_bulk
from workbench.tracking.rectangle import read_rectangle
from workbench.tracking.row_bulk import read_bulk as row_bulk
from workbench.tracking.row_table import version_of
from workbench.tracking.source import Source

Edit = Callable[[bytes], bytes]


def answers(data: bytes) -> bool:
    """Tell whether the bulk reader reads a file."""
    source = Source("x.csv", str, data)
    if data.startswith((b"Format", b"\xef\xbb\xbfFormat")):
        return motive_bulk(read_layout(source), source) is not None
    return row_bulk(source, version_of(source)) is not None


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
        ("row_1.1", lambda s: s.replace(b",NAN", b",-1.#INF", 1)),
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


def test_a_blank_last_cell_is_left_to_the_careful_reader(stored: Path, tmp_path: Path) -> None:
    lines = (stored / "hop_row_1.0.csv").read_bytes().split(b"\r\n")
    lines[-2] = lines[-2][: lines[-2].rindex(b",") + 1]
    text = b"\r\n".join(lines)
    assert not answers(text)
    found, faults = check(tmp_path / "x.csv", text)
    assert faults == []
    assert "has 23 cells and 2 markers; 24 cells" in str(found)


CELLS = st.one_of(
    st.floats(allow_nan=False, width=32).map(repr),
    st.sampled_from(
        ["", "NAN", "nan", "-0.0", "1e9", "1.5e9", "1_0", " 1", "1.", ".5", "0x1", "#"]
    ),
    st.text(alphabet='0123456789.-+eE "', max_size=5),
)


@settings(max_examples=300, deadline=None)
@given(rows=st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=5))
def test_a_number_read_in_bulk_is_the_one_that_python_reads(rows: list[tuple[str, str]]) -> None:
    text = "".join(f"7,{a},{b}\n" for a, b in rows)
    found = read_rectangle(text.encode(), 3, [1, 2])
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
            missing=np.where(lost, Missing.LOST, Missing.SEEN).astype(np.int8),
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
        empty = "there are no data columns|no marker is ever seen|no rate can be told"
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
