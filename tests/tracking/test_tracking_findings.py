"""What public files taught, each as a small file of our own with its right value.

Names begin with the number of the finding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_files import DEFINED, ROW_HEAD, ROWS, motive, points, six, told

from workbench.errors import TakeError
from workbench.tracking import (
    Axes,
    BodyNames,
    BodyTake,
    SampleStatus,
    Take,
    make_track,
    mean_speed,
    quality,
    read_take,
    write_motive,
)

MakeHop = Callable[..., Any]
Read = Callable[[bytes], Take]


def poses_alone(take: Take) -> Take:
    """Return a take as Motive exports it without markers."""

    def bare(body: BodyTake) -> BodyTake:
        none = np.empty((len(take), 0, 3))
        return replace(body, measured=none, solved=none, marker_names=())

    return replace(take, bodies={name: bare(body) for name, body in take.bodies.items()})


def exchanged(take: Take, one: str, other: str, rows: slice) -> Take:
    """Return a take in which two bodies have changed their columns in some rows."""
    a, b = take.bodies[one], take.bodies[other]
    parts: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for field in ("position", "quaternion"):
        mine, theirs = getattr(a, field).copy(), getattr(b, field).copy()
        mine[rows], theirs[rows] = theirs[rows].copy(), mine[rows].copy()
        parts[field] = mine, theirs
    a = replace(a, **{field: pair[0] for field, pair in parts.items()})
    b = replace(b, **{field: pair[1] for field, pair in parts.items()})
    return replace(take, bodies={**take.bodies, one: a, other: b})


def test_f1_a_frame_in_which_nothing_is_visible_is_a_frame(read: Read) -> None:
    take = read((ROW_HEAD + DEFINED + ROWS).encode())
    body = quality(take)["bodies"]["Foot"]
    assert (len(take), take.rate_hz, take.warnings) == (2, 100.0, ())
    assert (body["missing"], body["reasons"]) == (1, {"lost": 1})
    assert body["markers"] == {"Marker 1": 1, "Marker 2": 1, "Marker 3": 1}
    assert body["mean_position_m"] == pytest.approx([0.1, 0.7 / 3, 1 / 3])


def test_f1_the_same_in_version_1_1_and_with_the_first_frame_dark(read: Read) -> None:
    head = 'comment,x\nrighthanded\ninfo,version,1.1\nrigidbody,"Foot",1,1,0,0,0\n'
    dark = 'frame,0,0.0,0,0\nrigidbody,0,0.0,"Foot",1,1,1,0.1,0.2,0.3,1,NAN,NAN,NAN,0,1,0\n'
    seen = (
        'frame,1,0.01,1,1,0.1,0.2,0.3,0,0,0,1,0,0,0,1,0.1,0.2,0.3,1,"Foot-1"\n'
        'rigidbody,1,0.01,"Foot",1,0,1,0.1,0.2,0.3,1,0.1,0.2,0.3,1,1,0\n'
    )
    take = read((head + dark + seen).encode())
    assert take.version == "1.1"
    assert take.bodies["Foot"].missing.tolist() == [SampleStatus.LOST, SampleStatus.SEEN]
    assert take.cloud.position.shape == (2, 0, 3)


@pytest.mark.parametrize("pair", [("T", "Rotor"), ("Foot", "T"), ("Foot", "Rotor")])
def test_f2_exchanged_bodies_of_poses_alone_are_put_back(
    pair: tuple[str, str], tmp_path: Path, new_hop: MakeHop
) -> None:
    take = poses_alone(new_hop(seconds=12.5).take)
    wrong = exchanged(take, *pair, slice(600, 720))
    speeds = []
    for each, name in ((take, "right.csv"), (wrong, "wrong.csv")):
        write_motive(each, tmp_path / name)
        track = make_track(read_take(tmp_path / name), bodies=BodyNames(), axes=Axes())
        driven = track.raw.between(1.0, 10.0)
        speeds.append(mean_speed(driven.times, driven["rotor_angle_rad"]).value)
        assert sum(body["rejected"] for body in track.report["bodies"].values()) == 0
    assert speeds[1] == pytest.approx(speeds[0], abs=1e-9)
    assert any(
        f"'{pair[0]}' and '{pair[1]}': bodies exchanged in 120 samples (1 stretches, the first at "
        "5.000 s); undone" in warning
        for warning in track.warnings
    )


def test_f9_markers_alone_are_a_table_with_gaps_and_chained_ids(read: Read) -> None:
    columns = [*points("Unlabeled 7", "Marker"), *points("Unlabeled 9", "Marker")]
    rows = [[0.1, 0.2, 0.3 + 1e-4 * k] + [None] * 3 if k < 4 else [None] * 6 for k in range(6)] + [
        [None] * 3 + [0.1, 0.2, 0.301] for _ in range(4)
    ]
    take = read(motive(columns, rows))
    report = quality(take)
    assert (report["frames"], report["rate_hz"], report["bodies"]) == (10, 120.0, {})
    (marker,) = report["points"]
    assert marker["names"] == ["Unlabeled 7", "Unlabeled 9"]
    assert (marker["missing"], marker["gaps"], marker["longest_gap"]) == (2, 1, 2)
    assert told(take, "make rigid bodies Foot, T and Rotor in Motive, or label the markers")


def test_f9_a_thousand_names_are_not_listed(read: Read) -> None:
    columns = [column for k in range(1000) for column in points(f"Unlabeled {k}", "Marker")]
    take = read(motive(columns, [[0.1 * (i % 30) + 0.3 for i in range(3000)]] * 2))
    assert told(take, "'Unlabeled 7' and 992 more: make rigid bodies")
    assert max(map(len, take.warnings)) < 600


def test_f9_a_file_in_which_nothing_is_ever_seen_is_refused(read: Read) -> None:
    with pytest.raises(TakeError, match="no rigid bodies, and no marker is ever seen"):
        read(motive(points("Unlabeled 7", "Marker"), [[None] * 3] * 3))


def test_f3_cut_times_of_120_hz_are_not_125_hz(read: Read) -> None:
    rows = [[0.1 + 1e-4 * k, 0.2, 0.3] for k in range(5)]
    times = (0.000, 0.008, 0.016, 0.025, 0.033)
    assert read(motive(points("Foot"), rows, times, Export_Frame_Rate=None)).rate_hz == 120


@pytest.mark.parametrize(
    ("rate", "count"), [(120, 4), (120, 5), *((r, n) for r in (100, 240, 360) for n in (30, 1501))]
)
@pytest.mark.parametrize("way", [np.floor, np.round])
def test_f3_the_rate_comes_from_the_whole_time_column(
    way: Callable[[np.ndarray], np.ndarray], rate: int, count: int, read: Read
) -> None:
    times = way(np.arange(count) / rate * 1e3) / 1e3
    rows = [[0.1 + 1e-4 * k, 0.2, 0.3] for k in range(count)]
    absent: dict[str, Any] = {"Export_Frame_Rate": None, "Capture_Frame_Rate": None}
    take = read(motive(points("Foot"), rows, times.tolist(), **absent))
    assert take.rate_hz == rate
    np.testing.assert_allclose(take.times, np.arange(count) / rate, atol=1e-12)
    assert told(take, f"Export Frame Rate is ''; {rate} Hz found from the times")
    assert not told(take, "is used")


def test_f3_the_capture_rate_decides_where_digits_leave_it_open(read: Read) -> None:
    times = [0.0, 0.004, 0.008, 0.012, 0.016]  # 240 and 250 Hz fit
    rows = [[0.1 + 1e-4 * k, 0.2, 0.3] for k in range(5)]
    keys = {"Export_Frame_Rate": None, "Capture_Frame_Rate": "240.000000"}
    assert read(motive(points("Foot"), rows, times, **keys)).rate_hz == 240


def test_f3_a_stated_rate_is_checked_against_the_whole_column(read: Read) -> None:
    rows = [[0.1 + 1e-4 * k, 0.2, 0.3] for k in range(50)]
    take = read(motive(points("Foot"), rows, [k / 100 for k in range(50)]))
    assert take.rate_hz == 120
    assert told(take, "by up to 0.08167 s, at frame 49: its 50 rows have 100 Hz. The rate of the")
    assert told(take, "tracking: {rate: 100 Hz}")
    cut = [round(k / 120 - 4e-4, 3) for k in range(50)]
    assert read(motive(points("Foot"), rows, cut)).warnings == ()


def test_f3_a_row_formats_clock_that_is_cut_is_mended_by_the_index(read: Read) -> None:
    rows = "".join(f"frame,{k},{int(k / 0.12) / 1e3:.3f},0,1,1,2,3,7\n" for k in range(40))
    take = read(f"comment,x\ninfo,framecount,40\n{rows}".encode())
    assert take.rate_hz == 120
    np.testing.assert_allclose(take.times, np.arange(40) / 120, atol=1e-12)
    assert told(take, "the clock is cut to 1 ms; times are frame index / 120 Hz")


@pytest.mark.parametrize(("capture", "export"), [(240, 60), ("120.000000", 120), ("", 120)])
def test_f12_an_export_at_a_lower_rate_gives_no_hint(
    capture: object, export: object, read: Read
) -> None:
    rows = [[0.1 + 1e-4 * k, 0.2, 0.3] for k in range(5)]
    times = [k / int(str(export)) for k in range(5)]
    keys: dict[str, Any] = {"Capture_Frame_Rate": capture, "Export_Frame_Rate": export}
    assert read(motive(points("Foot"), rows, times, **keys)).warnings == ()


def test_f12_an_export_above_the_capture_rate_does(read: Read) -> None:
    rows = [[0.1 + 1e-4 * k, 0.2, 0.3] for k in range(5)]
    take = read(motive(points("Foot"), rows, Capture_Frame_Rate="30.000000"))
    assert told(take, "captured at 30 Hz, exported at 120 Hz; samples are not independent")


def test_f13_markers_that_were_not_exported_are_not_hidden(read: Read) -> None:
    solved = [*points("Foot"), *points("Foot:Marker1", "Rigid Body Marker")]
    rows = [[0.1 + 1e-4 * k] * 3 + [0.2 + 1e-4 * k] * 3 for k in range(6)]
    assert quality(read(motive(solved, rows)))["bodies"]["Foot"]["markers"] == {"Marker 1": None}
    both = [*solved, *points("Foot:Marker1", "Marker")]
    rows = [[*row, *([None] * 3 if k == 2 else row[3:])] for k, row in enumerate(rows)]
    assert quality(read(motive(both, rows)))["bodies"]["Foot"]["markers"] == {"Marker 1": 1}


def test_f6_a_body_that_never_moves_and_has_no_raw_marker_was_never_seen(read: Read) -> None:
    columns = [*points("Foot"), *points("Rotor"), *points("Foot:Marker1", "Marker")]
    rows = [[*six(k)[:3], 0.4, 0.5, 0.6, *six(k)[3:]] for k in range(20)]
    take = read(motive(columns, rows))
    bodies = quality(take)["bodies"]
    assert (bodies["Rotor"]["missing"], bodies["Rotor"]["reasons"]) == (20, {"frozen": 20})
    assert bodies["Foot"]["missing"] == 0
    assert told(take, "'Rotor' has the very same pose in all 20 rows that give one, which cameras")
    assert not told(take, "'Foot' has")


def test_f6_where_no_body_has_raw_markers_one_pose_is_a_warning(read: Read) -> None:
    rows = [[*six(k)[:3], 0.4, 0.5, 0.6] for k in range(20)]
    take = read(motive([*points("Foot"), *points("Rotor")], rows))
    assert quality(take)["bodies"]["Rotor"]["missing"] == 0
    assert told(take, "'Rotor' has the very same pose in all 20 rows that give one")
    assert told(take, "was it ever tracked?")


def test_f11_exact_zeros_are_no_places(read: Read) -> None:
    columns = [*points("Foot:Marker1", "Marker"), *points("Unlabeled 7", "Marker")]
    zero = ["0.000000"] * 3
    rows = [six(k) if k != 3 else [*zero, *six(k)[3:]] for k in range(6)]
    rows[5][3:] = [0.0, -0.0, "0.000000"]
    take = read(
        motive([*points("Foot"), *columns], [[*six(k)[:3], *r] for k, r in enumerate(rows)])
    )
    foot = quality(take)["bodies"]["Foot"]
    assert (foot["missing"], foot["markers"]) == (1, {"Marker 1": 1})
    assert np.isnan(take.cloud.position[5]).all()
    assert told(take, "markers of 'Foot' stand at exactly 0, 0, 0 in 1 sample(s), first at frame 3")
    assert told(
        take, "markers of no body stand at exactly 0, 0, 0 in 1 sample(s), first at frame 5"
    )


def test_f11_zeros_of_a_row_format_are_no_places(read: Read) -> None:
    zeros = ROWS.replace("1,0.1,0.2,0.4,2,", "1,0,0,0,2,").replace(
        "0.1,0.2,0.3,0.1,0.2,0.4,0.1,0.3,0.3,1,1,1", "0.1,0.2,0.3,0,0,0,0.1,0.3,0.3,1,1,1"
    )
    take = read((ROW_HEAD + DEFINED + zeros).encode())
    assert quality(take)["bodies"]["Foot"]["markers"]["Marker 2"] == 2
    assert take.cloud.position.shape[1] == 0
    assert told(take, "visible points stand at exactly 0, 0, 0 in 1 sample(s), first at frame 0")


@pytest.mark.parametrize(("hold", "in_effect"), [(2, 60), (3, 40), (6, 20)])
def test_f14_held_samples_are_told_and_do_not_count(hold: int, in_effect: int, read: Read) -> None:
    rows = [six(k - k % hold)[:3] for k in range(60)]
    take = read(motive(points("Foot"), rows))
    repeats = 60 - 60 // hold
    assert quality(take)["bodies"]["Foot"]["reasons"] == {"frozen": repeats}
    assert told(take, f"'Foot' repeats the sample before exactly in {repeats} samples at even")
    assert told(take, f"first at frame 1: {in_effect} Hz in effect, 120 Hz stated")


def test_f14_a_rate_that_is_no_part_of_the_stated_one_is_found(read: Read) -> None:
    rows = [six(k * 100 // 120)[:3] for k in range(120)]
    take = read(
        motive([*points("Foot"), *points("Foot:Marker1", "Marker")], [[*r, *r] for r in rows])
    )
    assert told(take, "'Foot' repeats the sample before exactly in 20 samples at even intervals")
    assert told(take, "100 Hz in effect, 120 Hz stated")


def test_f14_repeats_by_chance_and_a_body_at_rest_are_no_holds(read: Read) -> None:
    rng = np.random.default_rng(3)
    rounded = np.round(0.3 + rng.normal(0, 5e-4, (400, 3)), 3).tolist()
    assert read(motive(points("Foot"), rounded)).bodies["Foot"].seen.all()
    rest = [six(max(0, k - 200))[:3] for k in range(400)]
    assert read(motive(points("Foot"), rest)).warnings == ()


def test_f14_a_body_at_rest_that_is_out_of_sight_at_even_intervals_is_not_held(read: Read) -> None:
    moving = [six(0)[:3] if k < 50 else six(k)[:3] for k in range(60)]
    rows = [["", "", ""] if k % 3 == 2 else row for k, row in enumerate(moving)]
    take = read(motive(points("Foot"), rows))
    assert quality(take)["bodies"]["Foot"]["reasons"] == {"blank": 20}
    assert not told(take, "repeats the sample before exactly")


def test_f14_the_motion_of_held_samples_is_that_of_the_samples_that_were_taken(
    tmp_path: Path, new_hop: MakeHop
) -> None:
    take = poses_alone(new_hop(seconds=8.0, noise_m=0.0).take)
    rows = np.arange(len(take)) // 2 * 2
    held = {
        name: replace(body, position=body.position[rows], quaternion=body.quaternion[rows])
        for name, body in take.bodies.items()
    }
    write_motive(replace(take, bodies=held), tmp_path / "held.csv")
    write_motive(take, tmp_path / "whole.csv")
    motion = [
        make_track(read_take(tmp_path / name), bodies=BodyNames(), axes=Axes()).motion
        for name in ("held.csv", "whole.csv")
    ]
    late = motion[0].between(0.5, 5.0)
    off = late["rotor_x_m"] - motion[1].at(late.times)["rotor_x_m"]
    assert np.abs(off).max() < 1e-3  # half a sample late it would be 2.5 mm


def test_solved_markers_that_are_not_the_measured_ones_are_told(read: Read) -> None:
    columns = [*points("Foot"), *points("Foot:Marker1", "Rigid Body Marker")]
    columns += points("Foot:Marker1", "Marker")
    rows = [[*six(k)[:3], *six(k)[:3], *six(k)[3:]] for k in range(10)]
    take = read(motive(columns, rows))
    assert told(take, "the solved markers of 'Foot' lie 50.0 mm (median) from the measured ones")
