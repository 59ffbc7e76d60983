"""The oddities of real Motive exports, one by one."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.errors import TakeError
from workbench.tracking import (
    Axes,
    BodyNames,
    Cloud,
    SampleStatus,
    Take,
    make_track,
    quality,
    read_take,
    write_motive,
)
from workbench.tracking.take import known

Read = Callable[[bytes], Take]


@pytest.fixture
def plain(stored: Path) -> bytes:
    return (stored / "hop_motive_1.24.csv").read_bytes()


def assert_same_motion(a: Take, b: Take) -> None:
    for name, body in a.bodies.items():
        np.testing.assert_array_equal(body.position, b.bodies[name].position)
        np.testing.assert_array_equal(body.measured, b.bodies[name].measured)
        np.testing.assert_array_equal(body.missing, b.bodies[name].missing)


def edit_rows(data: bytes, edit: Callable[[int, list[bytes]], list[bytes]]) -> bytes:
    """Edit the cells of the data rows (number from 0)."""
    lines = data.split(b"\r\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(b"Frame")) + 1
    for i in range(first, len(lines) - 1):
        lines[i] = b",".join(edit(i - first, lines[i].split(b",")))
    return b"\r\n".join(lines)


@pytest.mark.parametrize(
    "edit",
    [
        lambda s: b"\xef\xbb\xbf" + s,
        lambda s: s.replace(b"\r\n", b"\n"),
        lambda s: s.replace(b"\r\n", b",,,\r\n"),
        lambda s: s + b"\r\n\r\n",
        lambda s: s.replace(b",X,Y,Z,W", b",x,y,z,w"),
        lambda s: s.replace(b"Rigid Body,", b'"Rigid Body",'),
        lambda s: s.replace(b"Type,", b"type,"),
    ],
    ids=["bom", "lf", "trailing-commas", "blank-end", "lower-axes", "quoted", "lower-words"],
)
def test_what_spreadsheets_and_versions_change_makes_no_difference(
    edit: Callable[[bytes], bytes], plain: bytes, read: Read
) -> None:
    assert edit(plain) != plain
    assert_same_motion(read(edit(plain)), read(plain))


@pytest.mark.parametrize("order", ["YXZ", "XYZ", "ZXY"])
def test_euler_angles_turn_about_the_bodys_own_axes(order: str, read: Read) -> None:
    axes = {"X": [1, 0, 0], "Y": [0, 1, 0], "Z": [0, 0, 1]}
    angles = (30.0, -20.0, 70.0)
    told = Rotation.identity()
    for letter, angle in zip(order, angles, strict=True):
        told = told * Rotation.from_rotvec(np.multiply(axes[letter], angle), degrees=True)
    row = ",".join(f"{angle}" for angle in angles)
    text = (
        "Format Version,1.23,Export Frame Rate,100,Total Exported Frames,2,Length Units,Meters\n\n"
        f",Type{6 * ',Rigid Body'}\n,Name{6 * ',Foot'}\n,ID{6 * ',A'}\n"
        f",{3 * ',Rotation'}{3 * ',Position'}\nFrame,Time (Seconds),{','.join(order)},X,Y,Z\n"
        f"0,0,{row},1,2,3\n1,0.01,{row},1,2,4\n"
    )
    found = read(text.encode()).bodies["Foot"].quaternion[0]
    assert (Rotation.from_quat(found, scalar_first=True) * told.inv()).magnitude() < 1e-9


def test_a_timecode_column_is_passed_over(plain: bytes, read: Read) -> None:
    lines = plain.split(b"\r\n")
    for i, line in enumerate(lines[2:], start=2):
        cells = line.split(b",")
        if len(cells) > 2:
            word = b"TimeCode" if cells[0] == b"Frame" else b"15:26:46:12.02"
            cells.insert(2, word if cells[0] else b"")
        lines[i] = b",".join(cells)
    assert_same_motion(read(b"\r\n".join(lines)), read(plain))


@pytest.mark.parametrize("cells", [[b"", b"0", b"0", b"1"], [b"0", b"0", b"0", b"0"]])
def test_a_quaternion_that_is_no_rotation_is_unknown(
    cells: list[bytes], plain: bytes, read: Read
) -> None:
    take = read(edit_rows(plain, lambda i, c: [*c[:2], *cells, *c[6:]] if i == 3 else c))
    unknown = ~known(take.bodies["Foot"].quaternion)
    assert np.flatnonzero(unknown).tolist() == [3, 5, 6, 7]  # 5 to 7 are lost
    make_track(take, bodies=BodyNames(), axes=Axes())


def test_header_counts_that_are_wrong_give_a_warning(plain: bytes, read: Read) -> None:
    take = read(plain.replace(b"Exported Frames,40", b"Exported Frames,99"))
    assert take.warnings == ("the header says '99' exported frames, the file has 40",)


def test_the_frame_index_may_start_anywhere_and_jump(plain: bytes, read: Read) -> None:
    def shift(i: int, cells: list[bytes]) -> list[bytes]:
        index = 72210 + i + (1000 if i >= 30 else 0)
        return [str(index).encode(), f"{index / 120:.6f}".encode(), *cells[2:]]

    take = read(edit_rows(plain, shift))
    assert (take.indices[0], take.indices[-1]) == (72210, 73249)
    assert take.times[0] == pytest.approx(72210 / 120)
    assert take.warnings == ("the frame index jumps 1 time(s), most from 72239 to 73240",)


def test_times_cut_to_milliseconds_are_computed_anew(plain: bytes, read: Read) -> None:
    take = read(
        edit_rows(plain, lambda i, c: [c[0], f"{int(i / 0.12) / 1000:.6f}".encode(), *c[2:]])
    )
    np.testing.assert_allclose(take.times, np.arange(40) / 120)
    assert take.warnings == ()
    assert 1e-4 < take.jitter_s < 1e-3


def test_times_that_contradict_the_rate_give_a_warning(plain: bytes, read: Read) -> None:
    take = read(plain.replace(b"Export Frame Rate,120.0", b"Export Frame Rate,100.0"))
    assert any("differs from frame / 100 Hz by up to 0.065 s" in w for w in take.warnings)
    assert any("its 40 rows have 120 Hz" in w for w in take.warnings)


def test_a_missing_rate_is_told_from_the_times(plain: bytes, read: Read) -> None:
    take = read(plain.replace(b"Export Frame Rate,120.000000,", b""))
    assert take.rate_hz == pytest.approx(120, rel=1e-4)
    assert "found from the times" in take.warnings[0]


def test_labelled_and_solved_markers_of_one_name_stay_apart(plain: bytes, read: Read) -> None:
    assert plain.count(b",Foot:Marker 001") == 7
    foot = read(plain).bodies["Foot"]
    assert foot.marker_names == ("Marker 1", "Marker 2", "Marker 3", "Marker 4")
    apart = np.linalg.norm(foot.measured - foot.solved, axis=2)
    assert 0 < np.nanmax(apart) < 1e-3


def test_a_marker_column_that_never_saw_anything_stays_blank(tmp_path: Path, small: Take) -> None:
    n = len(small)
    cloud = Cloud(np.full((n, 1, 3), np.nan), np.full((n, 1), "Unlabeled 9", dtype=object))
    write_motive(replace(small, cloud=cloud), tmp_path / "x.csv")
    read = read_take(tmp_path / "x.csv").cloud
    assert read.names[0, 0] == "Unlabeled 9"
    assert not known(read.position).any()


def test_markers_go_to_the_body_with_the_longest_name(tmp_path: Path, small: Take) -> None:
    bodies = {
        name: replace(body, name=name)
        for name, body in zip(("Foot", "Foot:A", "Foot 1"), small.bodies.values(), strict=True)
    }
    for version in ("1.21", "1.23", "1.24"):
        write_motive(replace(small, bodies=bodies), tmp_path / "x.csv", version)
        read = read_take(tmp_path / "x.csv").bodies
        assert {k: len(b.marker_names) for k, b in read.items()} == {
            "Foot": 4,
            "Foot:A": 2,
            "Foot 1": 2,
        }


def test_two_bodies_of_one_name_are_both_kept(plain: bytes, read: Read) -> None:
    lines = plain.split(b"\r\n")
    lines[3] = re.sub(rb",T(?=,)", b",Foot", lines[3])
    take = read(b"\r\n".join(lines))
    assert list(take.bodies) == ["Foot", "Foot (2)", "Rotor"]
    assert any("two bodies are named 'Foot'" in w for w in take.warnings)


def solved_take(small: Take) -> Take:
    """Return the foot as 1.24 exports solved bodies: zero at first, the last pose at the end."""
    foot = small.bodies["Foot"]
    position = np.where(foot.seen[:, None], foot.position, foot.position[0])
    position, quaternion = position.copy(), np.tile([1.0, 0, 0, 0], (len(small), 1))
    position += 1e-5 * np.arange(len(small))[:, None]
    measured = foot.solved.copy()
    position[:6], position[30:] = 0.0, position[29]
    measured[:6] = measured[30:] = np.nan
    solved = replace(foot, position=position, quaternion=quaternion, measured=measured)
    return replace(small, bodies={"Foot": solved})


@pytest.mark.parametrize("markers", [True, False])
def test_placeholder_and_frozen_poses_count_as_missing(
    tmp_path: Path, small: Take, markers: bool
) -> None:
    take = solved_take(small)
    if not markers:
        none = np.empty((len(small), 0, 3))
        bare = replace(take.bodies["Foot"], measured=none, solved=none, marker_names=())
        take = replace(take, bodies={"Foot": bare})
    write_motive(take, tmp_path / "x.csv", "1.24")
    read = read_take(tmp_path / "x.csv")
    told = quality(read)["bodies"]["Foot"]
    assert (told["missing"], told["gaps"], told["longest_gap"]) == (16, 2, 10)
    missing = read.bodies["Foot"].missing
    assert set(missing[:6]) == {SampleStatus.PLACEHOLDER}
    assert set(missing[30:]) == {SampleStatus.FROZEN}


def test_short_repeats_and_a_body_that_never_moved_are_not_frozen(
    tmp_path: Path, small: Take
) -> None:
    none = np.empty((len(small), 0, 3))
    body = replace(small.bodies["T"], measured=none, solved=none, marker_names=())
    still = np.tile(body.position[0], (len(small), 1))
    moving = still + 1e-4 * np.arange(len(small))[:, None]
    moving[20:24] = moving[20]
    take = replace(
        small,
        bodies={
            "still": replace(body, name="still", position=still),
            "moving": replace(body, name="moving", position=moving),
        },
    )
    write_motive(take, tmp_path / "x.csv")
    assert [b["missing"] for b in quality(read_take(tmp_path / "x.csv"))["bodies"].values()] == [
        0,
        0,
    ]


def test_bones_are_bodies_and_bone_markers_are_solved(plain: bytes, read: Read) -> None:
    boned = plain.replace(b"Rigid Body Marker", b"Bone Marker").replace(b"Rigid Body", b"Bone")
    assert boned != plain
    take = read(boned)
    assert_same_motion(take, read(plain))
    for name, body in take.bodies.items():
        np.testing.assert_array_equal(body.solved, read(plain).bodies[name].solved)


def test_error_and_quality_columns_are_kept(read: Read, small: Take, tmp_path: Path) -> None:
    write_motive(small, tmp_path / "x.csv", units="Millimeters")
    foot = read_take(tmp_path / "x.csv").bodies["Foot"]
    assert foot.reported_error is not None
    assert foot.marker_quality is not None
    seen = foot.seen
    np.testing.assert_allclose(foot.reported_error[seen], foot.fit_error[seen], atol=1e-8)
    assert np.isnan(foot.reported_error[~seen]).all()
    assert set(foot.marker_quality[seen].flat) == {1.0}


def test_solved_markers_of_bodies_named_alike_go_by_id(plain: bytes, read: Read) -> None:
    lines = plain.split(b"\r\n")
    lines[3] = lines[3].replace(b",Rotor", b",T")
    take = read(b"\r\n".join(lines))
    for name, was in (("T", "T"), ("T (2)", "Rotor")):
        np.testing.assert_array_equal(take.bodies[name].solved, read(plain).bodies[was].solved)


def test_measured_markers_that_could_be_of_two_bodies_are_left_out(
    plain: bytes, read: Read
) -> None:
    lines = plain.split(b"\r\n")
    lines[3] = lines[3].replace(b",Rotor", b",T")
    types, names, ids = (lines[i].split(b",") for i in (2, 3, 4))
    for i, (kind, name) in enumerate(zip(types, names, strict=True)):
        if kind == b"Marker" and name.startswith(b"T:"):
            ids[i] = b'"8392B20C"'
    lines[4] = b",".join(ids)
    take = read(b"\r\n".join(lines))
    assert not known(take.bodies["T"].measured).any()
    assert "markers of the bodies named 'T' cannot be assigned; left out" in take.warnings


def test_a_marker_with_two_columns_continues_in_the_second(plain: bytes, read: Read) -> None:
    lines = plain.split(b"\r\n")
    types, names = lines[2].split(b","), lines[3].split(b",")
    for i, (kind, name) in enumerate(zip(types, names, strict=True)):
        if (kind, name) == (b"Marker", b"T:Marker 002"):
            names[i] = b"T:Marker 001"
    lines[3] = b",".join(names)
    take = read(b"\r\n".join(lines))
    assert any(
        "'T:Marker 001' has columns that hold samples at the same" in w for w in take.warnings
    )
    np.testing.assert_array_equal(
        take.bodies["T"].measured[:, 0], read(plain).bodies["T"].measured[:, 0]
    )


@pytest.mark.parametrize(
    ("row", "old", "new", "match"),
    [
        (6, b",X,Y,Z,W,X,Y,Z", b",X,Y,Z,W,X,Y,", "from 3 on are incomplete: position XY"),
        (6, b"Frame,Time (Seconds),X,Y", b"Frame,Time (Seconds),X,", "rotation WXZ"),
        (3, b"Name" + 8 * b",Foot", b"Name" + 8 * b",", "give column 3 no name"),
        (2, b"Type" + 8 * b",Rigid Body", b"Type" + 8 * b",", "give column 3 no type"),
    ],
)
def test_a_header_that_is_damaged_is_refused(
    row: int, old: bytes, new: bytes, match: str, plain: bytes, read: Read
) -> None:
    lines = plain.split(b"\r\n")
    assert lines[row].startswith(old) or old in lines[row]
    lines[row] = lines[row].replace(old, new, 1)
    with pytest.raises(TakeError, match=match):
        read(b"\r\n".join(lines))


def test_a_header_row_too_many_is_refused_where_rows_have_no_words(
    stored: Path, read: Read
) -> None:
    lines = (stored / "hop_motive_1.21.csv").read_bytes().split(b"\r\n")
    lines.insert(3, lines[4])  # the ids would become the names
    with pytest.raises(TakeError, match=":8: more header rows are above 'Frame' than type"):
        read(b"\r\n".join(lines))


def test_every_reason_for_a_missing_sample_is_told(tmp_path: Path, small: Take) -> None:
    take = solved_take(small)
    foot = take.bodies["Foot"]
    position, measured = foot.position.copy(), foot.measured.copy()
    position[10], measured[12] = np.nan, np.nan
    body = replace(foot, position=position, measured=measured)
    write_motive(replace(take, bodies={"Foot": body}), tmp_path / "x.csv", "1.24")
    told = quality(read_take(tmp_path / "x.csv"))["bodies"]["Foot"]
    assert told["reasons"] == {"blank": 1, "lost": 1, "placeholder": 6, "frozen": 10}
    assert told["missing"] == 18


def test_a_file_without_a_last_line_end_gives_a_warning(plain: bytes, read: Read) -> None:
    assert "no line end" in read(plain.removesuffix(b"\r\n")).warnings[0]
    assert read(plain).warnings == ()
