"""TRC files: text between tabs, labelled markers and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_files import told

from workbench.errors import TakeError
from workbench.tracking import Axes, BodyNames, Take, make_track, read_take
from workbench.tracking.take import known

Read = Callable[[bytes], Take]
LABELS = ("Foot:Marker1", "Foot:Marker2", "T:Marker1", "Unlabeled 7")


def trc(
    points: np.ndarray, labels: tuple[str, ...] = LABELS, unit: str = "mm", rate: str = "120.00"
) -> str:
    """Return a file of points (n, k, 3) in that unit, blank where NaN."""
    n, k = points.shape[:2]
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    lines = [
        "PathFileType\t4\t(X/Y/Z)\thop.trc",
        "\t".join([*keys.split(), "OrigNumFrames"]),
        "\t".join([rate, "120.00", str(n), str(k), unit, "120.00", "1", str(n)]),
        "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(k) for axis in "XYZ"),
        "",
    ]
    for i, row in enumerate(points.reshape(n, -1)):
        cells = ["" if np.isnan(value) else f"{value:.5f}" for value in row]
        lines.append("\t".join([str(i + 1), f"{i / 120:.6f}", *cells]))
    return "\r\n".join([*lines, ""])


@pytest.fixture
def places() -> np.ndarray:
    """(n, k, 3) [mm]; the second marker is hidden in frames 5 to 8."""
    places = np.random.default_rng(1).uniform(-900, 900, (30, 4, 3))
    places[5:9, 1] = np.nan
    return places


def test_labels_name_the_bodies_and_blanks_hide_markers(places: np.ndarray, read: Read) -> None:
    take = read(trc(places).encode())
    assert (take.format, take.version, take.rate_hz, len(take)) == ("trc", "4", 120.0, 30)
    np.testing.assert_allclose(take.bodies["Foot"].measured, 1e-3 * places[:, :2], atol=1e-8)
    assert known(take.bodies["Foot"].measured[:, 1]).sum() == 26
    assert set(take.cloud.names.flat) == {"Unlabeled 7"}
    assert (take.indices[0], take.times[0]) == (1, 0.0)
    np.testing.assert_allclose(take.times, np.arange(30) / 120)
    assert take.warnings == ()


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001)])
def test_lengths_are_metres_whatever_the_unit(
    unit: str, metres: float, places: np.ndarray, read: Read
) -> None:
    take = read(trc(places, unit=unit).encode())
    np.testing.assert_allclose(take.bodies["T"].measured, metres * places[:, 2:3], atol=1e-5)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("\tmm\t", "\tfurlong\t", ":3: Units is 'furlong'; known are m, cm, mm"),
        ("\r\n4\t0.025000\t", "\r\n4\t0.025000\tx", ":10: column 3 holds 'x"),
        ("\r\n4\t0.025000\t", "\r\n4\t", ":10: the row has 13 cells; 4 markers need 14"),
        ("Foot:Marker1\t\t\t", "Foot:Marker1\t\t", ":4: the labels are not above three columns"),
        ("\r\n4\t0.025000\t", "\r\nfour\t0.025000\t", ":10: the frame number is 'four'"),
    ],
)
def test_what_cannot_be_read_is_named_by_line(
    old: str, new: str, match: str, places: np.ndarray, read: Read
) -> None:
    text = trc(places)
    assert old in text
    with pytest.raises(TakeError, match=match):
        read(text.replace(old, new, 1).encode())


def test_what_the_header_says_is_checked(places: np.ndarray, read: Read) -> None:
    text = trc(places, rate="100.00").replace("\t30\t4\t", "\t31\t4\t")
    take = read(text.encode())
    assert told(take, "the header says '31' frames, the file has 30")
    assert told(take, "its 30 rows have 120 Hz")
    take = read(trc(places, rate="").encode())
    assert take.rate_hz == 120.0
    assert told(take, "DataRate is ''; 120 Hz found from the times")


def test_zeros_are_no_places_and_labels_without_a_body_are_reported(
    places: np.ndarray, read: Read
) -> None:
    places[3, 0] = 0.0
    take = read(trc(places, labels=("a", "b", "c", "d")).encode())
    assert told(take, "markers stand at exactly 0, 0, 0 in 1 sample(s), first at frame 4")
    assert told(take, "the markers are named 'a', 'b', 'c', 'd': make rigid bodies")


def test_the_motion_is_that_of_the_export_with_poses(small: Take, tmp_path: Path) -> None:
    bodies = small.bodies
    labels = tuple(f"{name}:{marker}" for name in bodies for marker in bodies[name].marker_names)
    points = np.concatenate([body.measured for body in bodies.values()], axis=1)
    (tmp_path / "hop.trc").write_text(trc(1e3 * points, labels), encoding="utf-8")
    take = read_take(tmp_path / "hop.trc")
    for name, body in take.bodies.items():
        np.testing.assert_allclose(body.measured, bodies[name].measured, atol=1e-7)
    assert np.isfinite(make_track(take, bodies=BodyNames(), axes=Axes()).motion["top_x_m"]).any()
