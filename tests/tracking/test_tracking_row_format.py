"""The oddities of row-format files, one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.errors import TakeError
from workbench.tracking import SampleStatus, Take, quality, read_take, write_row

Read = Callable[[bytes], Take]


@pytest.fixture
def plain(stored: Path) -> bytes:
    return (stored / "hop_row_1.0.csv").read_bytes()


def test_a_clock_that_jitters_gives_rate_and_jitter(tmp_path: Path, small: Take) -> None:
    rng = np.random.default_rng(3)
    times = 0.0211 + np.arange(len(small)) / 250 + rng.uniform(-2e-4, 2e-4, len(small))
    write_row(replace(small, times=times), tmp_path / "x.csv")
    take = read_take(tmp_path / "x.csv")
    assert take.rate_hz == pytest.approx(250, rel=0.02)
    assert take.jitter_s == pytest.approx(np.std(np.diff(times)), rel=0.1)
    assert quality(take)["first_time_s"] == pytest.approx(times[0], abs=1e-8)


def test_the_rate_of_printed_times_is_exact(plain: bytes, read: Read) -> None:
    assert read(plain).rate_hz == 120.0


@pytest.mark.parametrize(
    "edit",
    [
        lambda s: b"\xef\xbb\xbf" + s,
        lambda s: s.replace(b"\r\n", b"\n"),
        lambda s: s.replace(b"\r\n", b",,,,\r\n"),
        lambda s: s.replace(b"trackable,", b"rigidbody,"),
        lambda s: s.replace(b'"Foot"', b"Foot"),
        lambda s: s.replace(b"NAN", b"-1.#IND"),
        lambda s: s.replace(b"NAN", b"1.#QNAN"),
        lambda s: s.replace(b"info,framecount,40", b"info,version,1\r\ninfo,framecount,40"),
    ],
    ids=["bom", "lf", "commas", "keyword", "unquoted", "ind", "qnan", "version-1"],
)
def test_rewritten_files_read_the_same(
    edit: Callable[[bytes], bytes], plain: bytes, read: Read
) -> None:
    assert edit(plain) != plain
    first, second = read(edit(plain)), read(plain)
    assert (first.version, first.warnings) == ("1.0", ())
    for name, body in first.bodies.items():
        np.testing.assert_array_equal(body.solved, second.bodies[name].solved)
        np.testing.assert_array_equal(body.measured, second.bodies[name].measured)
        np.testing.assert_array_equal(body.missing, second.bodies[name].missing)


def test_an_extra_field_and_repeated_frames_are_read_with_warnings(
    plain: bytes, read: Read
) -> None:
    lines = plain.split(b"\r\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(b"frame,"))
    lines = [line + b",7" if line.startswith(b"frame,") else line for line in lines]
    take = read(b"\r\n".join([*lines[: first + 4], *lines[first : first + 4], *lines[first + 4 :]]))
    assert len(take) == 41
    assert [w.split(",")[0].split(" at ")[0] for w in take.warnings] == [
        "frame rows have cells after their markers",
        "the header says '40' frames",
        "the frame index repeats or goes back 1 time(s)",
        "the clock does not advance",
    ]


def test_the_mean_is_over_tracked_rows_though_lost_ones_are_finite(
    plain: bytes, read: Read
) -> None:
    take = read(plain)
    foot = take.bodies["Foot"]
    assert np.isfinite(foot.centroid_solved).all()
    assert set(foot.missing[5:8]) == {SampleStatus.LOST}
    mean = quality(take)["bodies"]["Foot"]["mean_position_m"]
    np.testing.assert_allclose(mean, foot.centroid_solved[foot.seen].mean(axis=0))


def test_a_body_that_is_never_seen_has_no_mean(plain: bytes, read: Read) -> None:
    lost = plain.replace(b'"T",2,0,2', b'"T",2,9,2')
    told = quality(read(lost))["bodies"]["T"]
    assert (told["missing"], told["gaps"], told["longest_gap"]) == (40, 1, 40)
    assert (told["reasons"], told["mean_position_m"]) == ({"lost": 40}, None)


def test_left_handed_files_give_a_warning(plain: bytes, read: Read) -> None:
    take = read(plain.replace(b"righthanded\r\n", b"lefthanded\r\n"))
    assert "left-handed" in take.warnings[0]


def test_bodies_come_in_any_order_in_a_frame_row(plain: bytes, read: Read) -> None:
    lines = plain.split(b"\r\n")
    at = next(i for i, line in enumerate(lines) if line.startswith(b"frame,"))
    cells = lines[at].split(b",")
    lines[at] = b",".join([*cells[:4], *cells[15:26], *cells[4:15], *cells[26:]])
    for name, body in read(b"\r\n".join(lines)).bodies.items():
        np.testing.assert_array_equal(body.position, read(plain).bodies[name].position)


def lines_of(data: bytes) -> tuple[list[bytes], int]:
    """Return the lines, and which one is the first frame."""
    lines = data.split(b"\r\n")
    return lines, next(i for i, line in enumerate(lines) if line.startswith(b"frame,"))


def test_a_cell_too_many_in_one_frame_row_is_refused(plain: bytes, read: Read) -> None:
    lines, first = lines_of(plain)
    lines[first + 4] = lines[first + 4].replace(b",8,", b",8,0.5,")
    with pytest.raises(TakeError, match=rf":{first + 5}: the frame row has 1 cells after its 8"):
        read(b"\r\n".join(lines))


def test_rows_out_of_place_are_read_with_warnings(plain: bytes, read: Read) -> None:
    lines, first = lines_of(plain)
    del lines[first + 4]  # the second frame row: its bodies' rows now follow the first
    take = read(b"\r\n".join(lines))
    assert len(take) == 39
    told = " ".join(take.warnings)
    assert (
        f"rows of bodies have another index than the frame above them, first in line {first + 5}"
        in told
    )
    assert f"'Foot' has several rows in a frame, the last counts, first in line {first + 5}" in told


def test_a_body_without_a_row_in_a_frame_is_missing_there_with_a_warning(
    plain: bytes, read: Read
) -> None:
    lines, first = lines_of(plain)
    del lines[first + 2]
    take = read(b"\r\n".join(lines))
    assert take.warnings == ("body 'T' has no row in 1 frame(s); missing there",)
    assert take.bodies["T"].missing.tolist() == [SampleStatus.BLANK] + 39 * [SampleStatus.SEEN]


def test_error_and_quality_are_kept_as_reported(plain: bytes, read: Read) -> None:
    foot = read(plain).bodies["Foot"]
    assert foot.reported_error is not None
    assert foot.marker_quality is not None
    np.testing.assert_allclose(foot.reported_error[:5], foot.fit_error[:5], atol=1e-8)
    assert foot.marker_quality[:5].tolist() == [[1.0] * 4] * 5
    assert foot.marker_quality[5].tolist() == [0.0] * 4


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        (b'trackable,"T",2', b'trackable,"T",1', "id '1' belongs to 'Foot' already"),
        (b",3,1,", b",3,2,", "the frame lists body '2' twice"),
        (b"frame,1,0.00833333,", b"frame,1,,", "the time of the frame is not a number"),
        (b"frame,1,0.00833333,3,", b"frame,1,0.00833333,-3,", "tracked bodies is '-3'"),
    ],
)
def test_what_contradicts_itself_is_refused(
    old: bytes, new: bytes, match: str, plain: bytes, read: Read
) -> None:
    assert old in plain
    with pytest.raises(TakeError, match=match):
        read(plain.replace(old, new, 1))


def test_wrong_counts_of_bodies_give_a_warning(plain: bytes, read: Read) -> None:
    take = read(plain.replace(b"trackablecount,3", b"trackablecount,5"))
    assert take.warnings == ("the header says '5' bodies, the file has 3",)


def test_a_body_that_is_defined_and_never_reported_is_left_out(plain: bytes, read: Read) -> None:
    lines, first = lines_of(plain)
    lines.insert(first, b'trackable,"Ghost",9,2,0,0,0,0,0,1')
    take = read(b"\r\n".join(lines))
    assert list(take.bodies) == ["Foot", "T", "Rotor"]
    assert "body 'Ghost' is defined and has no rows; left out" in take.warnings
