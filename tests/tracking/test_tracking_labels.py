"""Exports of points alone: their labels tell the bodies."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.errors import InputError
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
    write_row,
)
from workbench.tracking.labels import bodies_by_label
from workbench.tracking.source import Source
from workbench.tracking.take import known

Read = Callable[[bytes], Take]


@pytest.mark.parametrize(
    ("label", "body", "marker"),
    [
        ("Foot_Marker1", "Foot", "Marker 1"),
        ("Foot:Marker1", "Foot", "Marker 1"),
        ("Foot:Marker 001", "Foot", "Marker 1"),
        ("Foot-Marker 12", "Foot", "Marker 12"),
        ("Foot_3", "Foot", "Marker 3"),
        ("Rigid Body 1:Marker2", "Rigid Body 1", "Marker 2"),
        ("left_foot:heel", "left_foot", "heel"),
        ("T:1", "T", "Marker 1"),
    ],
)
def test_a_label_names_a_body_and_a_marker(label: str, body: str, marker: str) -> None:
    bodies, loose = bodies_by_label([label], np.zeros((2, 1, 3)), Source("x", str, b""))
    assert {name: found.marker_names for name, found in bodies.items()} == {body: (marker,)}
    assert loose == []


@pytest.mark.parametrize(
    "label", ["Unlabeled:108", "Unlabeled 1007", "Unlabeled_3", "Marker-1718", "heel", "", "12"]
)
def test_a_label_that_names_no_body_stays_loose(label: str) -> None:
    bodies, loose = bodies_by_label([label], np.zeros((2, 1, 3)), Source("x", str, b""))
    assert (bodies, loose) == ({}, [0])


def test_a_marker_that_continues_in_a_second_column_is_one(small: Take) -> None:
    points = np.full((4, 2, 3), np.nan)
    points[:2, 0], points[2:, 1] = 1.0, 2.0
    source = Source("x", str, b"")
    bodies, _ = bodies_by_label(["A:Marker1", "A:Marker 001"], points, source)
    assert bodies["A"].measured[:, 0, 0].tolist() == [1, 1, 2, 2]
    assert source.warnings == []
    points[1, 1] = 5.0
    bodies, _ = bodies_by_label(["A:Marker1", "A:Marker 001"], points, source)
    assert bodies["A"].measured[1, 0, 0] == 1.0
    assert "hold samples at the same time, 1 in all" in source.warnings[0]


def only_markers(take: Take) -> Take:
    """Return a take whose bodies are known by the labels of loose points only."""
    names = [f"{body.name}:{label}" for body in take.bodies.values() for label in body.marker_names]
    points = np.concatenate([body.measured for body in take.bodies.values()], axis=1)
    labels = np.where(known(points), np.array(names, dtype=object), "")
    return replace(take, bodies={}, cloud=Cloud(points, labels))


@pytest.mark.parametrize("version", ["row 1.1", "motive 1.21", "motive 1.24"])
def test_an_export_of_labelled_markers_alone_gives_a_track(
    version: str, small: Take, tmp_path: Path
) -> None:
    kind, number = version.split()
    write = write_row if kind == "row" else write_motive
    write(only_markers(small), tmp_path / "x.csv", number)  # type: ignore[arg-type]
    take = read_take(tmp_path / "x.csv")
    assert take.bodies.keys() == small.bodies.keys()
    for name, body in take.bodies.items():
        given = small.bodies[name]
        places = [body.marker_names.index(label) for label in given.marker_names]
        np.testing.assert_allclose(body.measured[:, places], given.measured, atol=1e-6)
        assert set(body.missing[~given.seen]) == (
            {SampleStatus.BLANK} if (~given.seen).any() else set()
        )
        assert np.isnan(body.position).all()
    assert quality(take)["bodies"]["Foot"]["missing"] == 3
    track = make_track(take, bodies=BodyNames(), axes=Axes())
    whole = make_track(small, bodies=BodyNames(), axes=Axes())
    np.testing.assert_allclose(track.motion["top_z_m"], whole.motion["top_z_m"], atol=1e-6)


def test_points_without_a_body_are_reported_with_what_to_do(stored: Path, read: Read) -> None:
    data = (stored / "hop_motive_1.23.csv").read_bytes()
    data = data.replace(b"Rigid Body Marker", b"Camera").replace(b"Rigid Body", b"Camera")
    take = read(re.sub(rb"(Foot|T|Rotor):Marker", rb"Point", data))
    told = "no label like 'Foot:Marker1' names one; the markers are named 'Point1', 'Point2'"
    assert (len(take.bodies), any(told in warning for warning in take.warnings)) == (0, True)
    rows = b"".join(
        b"frame,%d,0.%d,0,1,1,2,3,7,Marker-17\r\n" % (index, index) for index in range(3)
    )
    take = read(b"comment,x\r\ninfo,version,1.1\r\n" + rows)
    assert any("named 'Marker-17': make rigid bodies Foot, T" in text for text in take.warnings)
    with pytest.raises(InputError, match="has no bodies, only markers; make rigid bodies Foot"):
        make_track(take, bodies=BodyNames(), axes=Axes())
