"""What a writer writes, the reader reads back within the printed digits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.errors import InputError
from workbench.tracking import SampleStatus, Take, quality, read_take, write_motive, write_row
from workbench.tracking.take import known

ROW = {"1.0", "1.1"}
MOTIVE = ("1.21", "1.22", "1.23", "1.24", "1.25")
UNIT_DIGITS = {"Meters": 1e-6, "Centimeters": 1e-8, "Millimeters": 1e-9}


def assert_same(a: np.ndarray, b: np.ndarray, within: float) -> None:
    assert a.shape == b.shape
    np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
    np.testing.assert_allclose(a, b, rtol=0, atol=within)


def assert_same_turn(a: np.ndarray, b: np.ndarray, within: float) -> None:
    np.testing.assert_array_equal(known(a), known(b))
    first, second = (Rotation.from_quat(q[known(a)], scalar_first=True) for q in (a, b))
    assert (first * second.inv()).magnitude().max() < within


def assert_same_take(read: Take, written: Take, digit: float) -> None:
    np.testing.assert_array_equal(read.indices, written.indices)
    np.testing.assert_allclose(read.times, written.times, rtol=0, atol=1e-8)
    assert read.rate_hz == written.rate_hz
    assert list(read.bodies) == list(written.bodies)
    for name, body in read.bodies.items():
        other = written.bodies[name]
        assert (body.id, body.marker_names) == (other.id, other.marker_names)
        assert_same(body.position, other.position, digit)
        assert_same(body.measured, other.measured, digit)
        assert_same_turn(body.quaternion, other.quaternion, 1e-5)
        np.testing.assert_array_equal(body.seen, other.seen)
    seen = known(written.cloud.position)
    assert set(read.cloud.names[known(read.cloud.position)]) == set(written.cloud.names[seen])
    assert_same(read.cloud.position, written.cloud.position, digit)


@pytest.mark.parametrize("version", sorted(ROW))
def test_row_format_gives_the_take_back(tmp_path: Path, small: Take, version: str) -> None:
    write_row(small, tmp_path / "x.csv", version)  # type: ignore[arg-type]
    read = read_take(tmp_path / "x.csv")
    assert (read.format, read.version, read.warnings) == ("row", version, ())
    assert_same_take(read, small, 1e-8)
    for name, body in read.bodies.items():
        assert_same(body.solved, small.bodies[name].solved, 1e-8)
        np.testing.assert_array_equal(body.missing, small.bodies[name].missing)


@pytest.mark.parametrize("version", MOTIVE)
@pytest.mark.parametrize("rotation", ["Quaternion", "XYZ", "YXZ", "ZYX", "XZY", "YZX", "ZXY"])
def test_motive_gives_the_take_back(
    tmp_path: Path, small: Take, version: str, rotation: str
) -> None:
    write_motive(small, tmp_path / "x.csv", version, rotation)  # type: ignore[arg-type]
    read = read_take(tmp_path / "x.csv")
    assert (read.format, read.version, read.warnings) == ("motive", version, ())
    assert_same_take(read, small, 1e-6)
    for name, body in read.bodies.items():
        seen = small.bodies[name].seen
        assert_same(body.solved[seen], small.bodies[name].solved[seen], 1e-6)
        assert set(body.missing[~seen]) <= {SampleStatus.BLANK}


@pytest.mark.parametrize("units", ["Meters", "Centimeters", "Millimeters"])
def test_lengths_are_metres_whatever_the_unit(tmp_path: Path, small: Take, units: str) -> None:
    write_motive(small, tmp_path / "x.csv", units=units)  # type: ignore[arg-type]
    assert_same_take(read_take(tmp_path / "x.csv"), small, UNIT_DIGITS[units])


def test_both_formats_report_the_same_gaps(
    tmp_path: Path, small: Take, lose: Callable[[Take, str, int, int], Take]
) -> None:
    take = lose(small, "T", 0, 4)
    write_row(take, tmp_path / "row.csv")
    write_motive(take, tmp_path / "motive.csv")
    row, motive = (quality(read_take(tmp_path / f"{f}.csv"))["bodies"] for f in ("row", "motive"))
    for name, told in {"Foot": (3, 1, 3), "T": (4, 1, 4), "Rotor": (12, 1, 12)}.items():
        for report in (row, motive):
            assert tuple(report[name][k] for k in ("missing", "gaps", "longest_gap")) == told


def test_the_lost_counter_counts_and_model_markers_stay_finite(tmp_path: Path, small: Take) -> None:
    write_row(small, tmp_path / "x.csv")
    rows = [
        line.split(",")
        for line in (tmp_path / "x.csv").read_bytes().decode().split("\r\n")
        if line.startswith("trackable,") and '"Foot"' in line
    ][1:]
    assert [row[5] for row in rows[4:9]] == ["0", "1", "2", "3", "0"]
    assert "NAN" not in rows[6][7:19]
    assert rows[6][19:31] == ["NAN"] * 12


def test_a_frame_row_lists_only_tracked_bodies(tmp_path: Path, small: Take) -> None:
    write_row(small, tmp_path / "x.csv", "1.1")
    frames = [
        line.split(",")
        for line in (tmp_path / "x.csv").read_text().splitlines()
        if line.startswith("frame,")
    ]
    assert (frames[4][3], frames[5][3], frames[8][3]) == ("3", "2", "3")
    assert len(frames[5]) < len(frames[4])


@pytest.mark.parametrize("word", ["Foot, left", 'Foot "A"', "Füße", "Foot 10"])
def test_names_survive(tmp_path: Path, small: Take, word: str) -> None:
    renamed = replace(small.bodies["Foot"], name=word)
    bodies = {word: renamed, "T": small.bodies["T"], "Rotor": small.bodies["Rotor"]}
    take = replace(small, bodies=bodies)
    write_row(take, tmp_path / "row.csv", "1.1")
    assert_same_take(read_take(tmp_path / "row.csv"), take, 1e-8)
    for version in MOTIVE:
        write_motive(take, tmp_path / "motive.csv", version)
        assert_same_take(read_take(tmp_path / "motive.csv"), take, 1e-6)


def test_stored_exports_are_what_the_writers_write(stored: Path, small: Take) -> None:
    files = sorted(stored.glob("*.csv"))
    assert len(files) == len(ROW) + len(MOTIVE)
    for file in files:
        assert_same_take(read_take(file), small, 1e-8 if "row" in file.name else 1e-6)


def test_writers_refuse_what_they_cannot_write(tmp_path: Path, small: Take) -> None:
    none = np.empty((len(small), 0, 3))
    bare = replace(small.bodies["T"], measured=none, solved=none, marker_names=())
    with pytest.raises(InputError, match="body 'T' has no markers"):
        write_row(replace(small, bodies={"T": bare}), tmp_path / "x.csv")
    with pytest.raises(InputError, match=r"row format version '2.0' is unknown"):
        write_row(small, tmp_path / "x.csv", "2.0")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="Motive rotation 'XXX' is unknown; there are Quaternion"):
        write_motive(small, tmp_path / "x.csv", rotation="XXX")


def disturbed(take: Take) -> Take:
    """Return a take with exchanged markers, an outlier far away, and single markers hidden."""
    foot = take.bodies["Foot"]
    measured = foot.measured.copy()
    measured[10:14, [0, 1]] = measured[10:14, [1, 0]]
    measured[16, 2] += 12.5
    measured[18:20, 3] = np.nan
    return replace(take, bodies=dict(take.bodies) | {"Foot": replace(foot, measured=measured)})


@pytest.mark.parametrize("version", [*sorted(ROW), *MOTIVE])
@pytest.mark.parametrize("units", ["Meters", "Centimeters", "Millimeters"])
def test_exchanges_outliers_and_hidden_markers_survive_as_they_are(
    tmp_path: Path, small: Take, version: str, units: str
) -> None:
    take, path = disturbed(small), tmp_path / "x.csv"
    if version in ROW:
        write_row(take, path, version)  # type: ignore[arg-type]
    else:
        write_motive(take, path, version, units=units)  # type: ignore[arg-type]
    read = read_take(path)
    assert read.warnings == ()
    assert_same_take(read, take, 1e-8 if version in ROW else UNIT_DIGITS[units])
    assert quality(read)["bodies"]["Foot"]["markers"]["Marker 4"] == 5
