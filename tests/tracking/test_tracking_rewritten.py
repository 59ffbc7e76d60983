"""Exports that a program or a spreadsheet has rewritten: what is whole in them is read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_files import (
    DARK,
    DARK_BODY,
    DEFINED,
    ROW_HEAD,
    SEEN,
    SEEN_BODY,
    motive,
    points,
    six,
    told,
)

from workbench.errors import TakeError
from workbench.tracking import Axes, BodyNames, SampleStatus, Take, make_track, quality

Read = Callable[[bytes], Take]
MIDDLE = [0.1, 0.7 / 3, 1 / 3]


def test_f8_ids_that_only_the_frame_rows_have_leave_the_body_rows_whole(read: Read) -> None:
    rows = SEEN.format(id=0) + SEEN_BODY + DARK + DARK_BODY
    take = read((ROW_HEAD + DEFINED + rows).encode())
    foot = quality(take)["bodies"]["Foot"]
    assert (list(take.bodies), foot["missing"]) == (["Foot"], 1)
    assert foot["mean_position_m"] == pytest.approx(MIDDLE)
    np.testing.assert_array_equal(take.bodies["Foot"].position[0], [0.1, 0.2, 0.3])
    assert told(take, "frame rows track bodies with the ids '0', which no other row names")
    assert told(take, "'0' for 'Foot'")


def test_f8_ids_that_are_all_one_too_low_get_their_own_bodies(
    stored: Path, small: Take, read: Read
) -> None:
    lines = (stored / "hop_row_1.0.csv").read_bytes().split(b"\r\n")
    for at, line in enumerate(lines):
        cells = line.split(b",")
        if cells[0] == b"frame":
            for k in range(4, 4 + 11 * int(cells[3]), 11):
                cells[k] = b"%d" % (int(cells[k]) - 1)
            lines[at] = b",".join(cells)
    take = read(b"\r\n".join(lines))
    whole = read((stored / "hop_row_1.0.csv").read_bytes())
    for name, body in whole.bodies.items():
        np.testing.assert_array_equal(take.bodies[name].position, body.position)
        np.testing.assert_array_equal(take.bodies[name].missing, body.missing)
    assert told(take, "'0' for 'Foot', '1' for 'T', '2' for 'Rotor'")


def test_f8_poses_that_fit_no_body_are_left_out(read: Read) -> None:
    far = SEEN.format(id=0).replace("1,0,0.1,0.2,0.3,0,0,0,1", "1,0,5.1,0.2,0.3,0,0,0,1")
    take = read((ROW_HEAD + DEFINED + far + SEEN_BODY + DARK + DARK_BODY).encode())
    assert np.isnan(take.bodies["Foot"].position).all()
    assert quality(take)["bodies"]["Foot"]["missing"] == 1
    assert told(take, "poses are taken by where the markers are: none")


def test_f8_poses_without_body_rows_make_a_body(read: Read) -> None:
    take = read((ROW_HEAD + DEFINED + SEEN.format(id=1) + DARK).encode())
    foot = quality(take)["bodies"]["Foot"]
    assert take.bodies["Foot"].missing.tolist() == [SampleStatus.SEEN, SampleStatus.LOST]
    assert (foot["missing"], foot["reasons"], foot["markers"]) == (1, {"lost": 1}, {})
    assert foot["mean_position_m"] == [0.1, 0.2, 0.3]
    assert told(take, "'Foot' has no rows of its own, only poses in the frame rows")


@pytest.mark.parametrize("version", ["1.0", "1.1"])
def test_f8_without_a_definition_the_body_rows_tell(version: str, stored: Path, read: Read) -> None:
    data = (stored / f"hop_row_{version}.csv").read_bytes()
    lines = data.split(b"\r\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(b"frame,"))
    word = b"trackable," if version == "1.0" else b"rigidbody,"
    kept = [line for i, line in enumerate(lines) if i > first or not line.startswith(word)]
    assert len(kept) == len(lines) - 3
    take, whole = read(b"\r\n".join(kept)), read(data)
    assert set(take.bodies) == {"Foot", "T", "Rotor"}
    for name, body in whole.bodies.items():
        np.testing.assert_array_equal(take.bodies[name].measured, body.measured)
        np.testing.assert_array_equal(take.bodies[name].missing, body.missing)


def test_f8_ids_alone_are_names(read: Read) -> None:
    take = read((ROW_HEAD + SEEN.format(id=4) + DARK).encode())
    assert list(take.bodies) == ["Body 4"]
    assert told(take, "the ids '4', which no row defines; the ids are taken for their names")


def test_f8_a_motion_of_poses_alone_can_be_tracked(stored: Path, read: Read) -> None:
    lines = (stored / "hop_row_1.0.csv").read_bytes().split(b"\r\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(b"frame,"))
    kept = [line for i, line in enumerate(lines) if i < first or line.startswith(b"frame,")]
    take = read(b"\r\n".join([*kept, b""]))
    track = make_track(take, bodies=BodyNames(), axes=Axes())
    assert np.isfinite(track.motion["top_z_m"]).any()


@pytest.mark.parametrize("stray", ["Type", "x", "Name"])
@pytest.mark.parametrize("blank", ["\n", ""])
def test_f10_a_stray_first_cell_in_a_header_row_is_ignored(
    stray: str, blank: str, read: Read
) -> None:
    plain = motive(points("Foot"), [six(k)[:3] for k in range(5)], blank=blank)
    take = read(plain.replace(b"\n,Type,", b"\n%s,Type," % stray.encode()))
    np.testing.assert_array_equal(take.bodies["Foot"].position, read(plain).bodies["Foot"].position)
    assert told(take, f"the header row in line {3 if blank else 2} begins with '{stray}'; ignored")


def test_f10_numbers_before_the_axis_row_are_still_refused(read: Read) -> None:
    plain = motive(points("Foot"), [six(0)[:3]])
    with pytest.raises(TakeError, match=":3: data begin without the header row that starts with"):
        read(plain.replace(b"\n,Type,", b"\n0,Type,"))
