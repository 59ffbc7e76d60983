"""The oddities of row-format files, one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.tracking import Missing, Take, quality, read_take, write_row

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
    assert set(foot.missing[5:8]) == {Missing.LOST}
    mean = quality(take)["bodies"]["Foot"]["mean_position_m"]
    np.testing.assert_allclose(mean, foot.centroid_solved[foot.seen].mean(axis=0))


def test_a_body_that_is_never_seen_has_no_mean(plain: bytes, read: Read) -> None:
    lost = plain.replace(b'"T",2,0,2', b'"T",2,9,2')
    told = quality(read(lost))["bodies"]["T"]
    assert told == {"missing": 40, "gaps": 1, "longest_gap": 40, "mean_position_m": None}


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
