"""What a sheet states of a take, and the unit of length that the robot's size tells."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_files import motive, points, six, told

from workbench.errors import InputError
from workbench.tracking import (
    Axes,
    BodyNames,
    Exchange,
    Overrides,
    SampleStatus,
    Take,
    make_track,
    quality,
    raw_points,
    read_take,
    with_overrides,
    write_motive,
)

MakeHop = Callable[..., Any]
Read = Callable[[bytes], Take]


@pytest.fixture
def in_centimetres(tmp_path: Path, small: Take) -> bytes:
    write_motive(small, tmp_path / "cm.csv", units="Centimeters")
    return (tmp_path / "cm.csv").read_bytes()


def positions(take: Take) -> dict[str, np.ndarray]:
    points = raw_points(take, BodyNames(), Axes())
    return {role: body.position for role, body in points.bodies.items()}


def test_f16_without_a_unit_the_robot_s_size_tells_it(
    in_centimetres: bytes, read: Read, small: Take
) -> None:
    take = read(in_centimetres.replace(b"Length Units,Centimeters,", b""))
    points = raw_points(take, BodyNames(), Axes())
    for role, right in positions(small).items():
        np.testing.assert_allclose(points.bodies[role].position, right, atol=1e-6)
    warnings = make_track(take, bodies=BodyNames(), axes=Axes()).warnings
    (sentence,) = [text for text in warnings if text.startswith("T is ")]
    assert re.match(r"T is 2\d(\.\d)? m from the foot and the rotor 3\.5 m from T", sentence)
    assert "as the file is read (m, it states no unit)" in sentence
    assert sentence.endswith("in cm that is the robot, so it is read in cm")


@pytest.mark.parametrize(("factor", "unit"), [(0.01, "cm"), (0.001, "mm"), (0.0254, "in")])
def test_f16_a_row_format_states_no_unit(factor: float, unit: str, new_hop: MakeHop) -> None:
    take = new_hop(seconds=3.0).take
    wrong = replace(
        take,
        unit_stated=False,
        bodies={
            name: replace(
                body,
                position=body.position / factor,
                measured=body.measured / factor,
                solved=body.solved / factor,
            )
            for name, body in take.bodies.items()
        },
    )
    assert f"so it is read in {unit}" in raw_points(wrong, BodyNames(), Axes()).warnings[0]
    for role, right in positions(take).items():
        np.testing.assert_allclose(positions(wrong)[role], right, atol=1e-9)


def test_f16_a_stated_unit_that_cannot_be_is_refused_with_the_one_that_can(
    in_centimetres: bytes, read: Read
) -> None:
    take = read(in_centimetres.replace(b"Units,Centimeters", b"Units,Meters"))
    words = r"\(m, as it states\); in cm that is the robot\. .*tracking: \{unit: cm\}"
    with pytest.raises(InputError, match=words):
        make_track(take, bodies=BodyNames(), axes=Axes())


def test_f16_one_export_says_which_unit_would_do(tmp_path: Path, new_hop: MakeHop) -> None:
    write_motive(new_hop(seconds=4.0).take, tmp_path / "x.csv", units="Millimeters")
    data = (tmp_path / "x.csv").read_bytes().replace(b"Length Units,Millimeters,", b"")
    (tmp_path / "x.csv").write_bytes(data)
    warnings = quality(read_take(tmp_path / "x.csv"))["warnings"]
    assert any(text.startswith("in mm three bodies have the robot's size") for text in warnings)


def test_a_stated_unit_goes_before_the_file_s(
    in_centimetres: bytes, read: Read, small: Take
) -> None:
    take = read(in_centimetres.replace(b"Units,Centimeters", b"Units,Meters"))
    stated = with_overrides(take, Overrides(unit="cm"))
    for role, right in positions(small).items():
        np.testing.assert_allclose(positions(stated)[role], right, atol=1e-6)
    assert told(stated, "lengths are read in cm, as stated; the file was read in m")
    assert with_overrides(read(in_centimetres), Overrides(unit="cm")).warnings == ()
    with pytest.raises(InputError, match="unit of length 'ft' is unknown; there are m, cm, mm, in"):
        with_overrides(take, Overrides(unit="ft"))


def test_a_stated_rate_goes_before_the_file_s(small: Take) -> None:
    stated = with_overrides(small, Overrides(rate_hz=100.0))
    assert stated.rate_hz == 100.0
    np.testing.assert_allclose(stated.times, small.indices / 100.0)
    assert told(stated, "the rate is 100 Hz, as stated; the file says 120 Hz.")
    assert with_overrides(small, Overrides(rate_hz=120.0)) is small


def test_a_stated_exchange_is_undone_even_of_a_whole_take(small: Take) -> None:
    names = {"T": "Rotor", "Rotor": "T"}
    wrong = replace(
        small,
        bodies={
            name: replace(small.bodies[names.get(name, name)], name=name) for name in small.bodies
        },
    )
    stated = with_overrides(wrong, Overrides(exchanged=(Exchange(("T", "Rotor")),)))
    for name, body in small.bodies.items():
        np.testing.assert_array_equal(stated.bodies[name].measured, body.measured)
        np.testing.assert_array_equal(stated.bodies[name].missing, body.missing)
    assert told(stated, "'T' and 'Rotor' were exchanged in 40 samples, as stated")
    part = with_overrides(small, Overrides(exchanged=(Exchange(("T", "Rotor"), 10, 12),)))
    changed = (part.bodies["T"].measured != small.bodies["T"].measured).any(axis=(1, 2))
    assert np.flatnonzero(changed).tolist() == [10, 11, 12]


@pytest.mark.parametrize(
    ("exchange", "match"),
    [
        (Exchange(("T", "Roter")), "'Roter' is not in the take; .*Rotor"),
        (Exchange(("T", "Rotor"), 500, 600), "no frame lies from 500 to 600; the take has 0 to 39"),
    ],
)
def test_an_exchange_that_cannot_be_is_refused(exchange: Exchange, match: str, small: Take) -> None:
    with pytest.raises(InputError, match=match):
        with_overrides(small, Overrides(exchanged=(exchange,)))


def test_samples_above_a_limit_of_the_error_do_not_count(read: Read) -> None:
    columns = [*points("Foot"), ("Rigid Body", "Foot", ""), *points("Foot:Marker1", "Marker")]
    rows = [[*six(k)[:3], 2e-3 if k == 4 else 1e-4, *six(k)[3:]] for k in range(8)]
    take = with_overrides(read(motive(columns, rows)), Overrides(limits={"Foot": 1e-3}))
    foot = take.bodies["Foot"]
    assert foot.missing.tolist() == [0, 0, 0, 0, SampleStatus.POOR, 0, 0, 0]
    assert np.isnan(foot.measured[4]).all()
    assert quality(take)["bodies"]["Foot"]["reasons"] == {"poor": 1}
    assert told(take, "'Foot': 1 samples have an error above 1 mm, first at frame 4; they do not")


def test_a_limit_without_an_error_says_so_and_without_the_body_is_refused(read: Read) -> None:
    take = read(motive(points("Foot"), [six(k)[:3] for k in range(8)]))
    assert told(
        with_overrides(take, Overrides(limits={"Foot": 1e-3})),
        "the file gives no error of 'Foot'; its limit of 1 mm does nothing",
    )
    with pytest.raises(InputError, match="limits: 'Fuss' is not in the take; there are 'Foot'"):
        with_overrides(take, Overrides(limits={"Fuss": 1e-3}))
