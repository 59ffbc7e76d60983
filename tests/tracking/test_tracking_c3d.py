"""C3D: points with labels, made here by ezc3d itself."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c3d_files import Processor, c3d_bytes
from numpy.typing import NDArray

from workbench.errors import TakeError
from workbench.tracking import Axes, BodyNames, SampleStatus, Take, make_track, quality, read_take
from workbench.tracking.c3d_data import read_header, read_points
from workbench.tracking.take import known

ezc3d = pytest.importorskip("ezc3d", reason="needs the extra `c3d`")

RATE = 160.0
FRAMES = 50
LABELS = ("Foot_Marker1", "Foot_Marker2", "T:Marker 001", "Unlabeled 1007")
Write = Callable[..., Path]


@pytest.fixture
def places() -> NDArray[np.float64]:
    """(n, k, 3) [m]; the second marker is hidden in frames 5 to 8."""
    places = np.random.default_rng(1).uniform(-1, 1, (FRAMES, len(LABELS), 3))
    places[5:9, 1] = np.nan
    return places


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def to_file(
        points_m: NDArray[np.float64],
        labels: tuple[str, ...] = LABELS,
        unit: str = "mm",
        scale: float = 1000.0,
    ) -> Path:
        file = ezc3d.c3d()
        file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
        file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
        file["parameters"]["POINT"]["LABELS"]["value"] = labels
        data = np.ones((4, points_m.shape[1], len(points_m)))
        data[:3] = points_m.transpose(2, 1, 0) * scale
        file["data"]["points"] = data
        file.write(str(tmp_path / "x.c3d"))
        return tmp_path / "x.c3d"

    return to_file


def test_labels_name_the_bodies_and_residuals_hide_markers(
    write: Write, places: NDArray[np.float64]
) -> None:
    take = read_take(write(places))
    assert (take.format, take.rate_hz, len(take)) == ("c3d", RATE, FRAMES)
    assert {name: body.marker_names for name, body in take.bodies.items()} == {
        "Foot": ("Marker 1", "Marker 2"),
        "T": ("Marker 1",),
    }
    foot = take.bodies["Foot"].measured
    np.testing.assert_array_equal(known(foot), known(places[:, :2]))
    np.testing.assert_allclose(foot, places[:, :2], atol=1e-6)  # 32 bit floats of millimetres
    assert set(take.cloud.names.flat) == {"Unlabeled 1007"}
    np.testing.assert_allclose(take.cloud.position[:, 0], places[:, 3], atol=1e-6)
    assert any("usually z-up" in warning for warning in take.warnings)


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cm", 100.0), ("mm", 1000.0)])
def test_lengths_are_metres_whatever_the_unit(
    unit: str, scale: float, write: Write, places: NDArray[np.float64]
) -> None:
    take = read_take(write(places, unit=unit, scale=scale))
    np.testing.assert_allclose(take.bodies["T"].measured[:, 0], places[:, 2], atol=1e-6)


@pytest.mark.parametrize("first", [0, 1, 500])
def test_the_first_frame_may_be_any(first: int, write: Write, places: NDArray[np.float64]) -> None:
    path = write(places)
    data = bytearray(path.read_bytes())
    struct.pack_into("<2H", data, 6, first, first + FRAMES - 1)
    path.write_bytes(data)
    take = read_take(path)
    assert (take.indices[0], take.indices[-1]) == (first, first + FRAMES - 1)
    np.testing.assert_allclose(take.times, take.indices / RATE)


def test_a_residual_below_zero_says_that_a_point_was_not_seen(
    write: Write, places: NDArray[np.float64]
) -> None:
    path = write(places)
    data = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<H", data, 16)
    struct.pack_into("<f", data, 512 * (start - 1) + 12, -1.0)  # of the first frame's first point
    path.write_bytes(data)
    foot = read_take(path).bodies["Foot"].measured
    assert known(foot[:3, 0]).tolist() == [False, True, True]


def test_a_body_counts_as_seen_while_any_marker_is(
    write: Write, places: NDArray[np.float64]
) -> None:
    places[20:23, :2] = np.nan
    told = quality(read_take(write(places)))["bodies"]["Foot"]
    assert (told["missing"], told["gaps"], told["longest_gap"]) == (3, 1, 3)
    assert told["reasons"] == {"blank": 3}
    assert told["markers"] == {"Marker 1": 3, "Marker 2": 7}
    whole = known(places[:, :2]).all(axis=1)
    middle = places[whole, :2].mean(axis=(0, 1))
    np.testing.assert_allclose(told["mean_position_m"], middle, atol=1e-6)


def test_the_motion_is_that_of_the_export_with_poses(write: Write, small: Take) -> None:
    bodies = small.bodies
    labels = tuple(f"{name}:{marker}" for name in bodies for marker in bodies[name].marker_names)
    points = np.concatenate([body.measured for body in bodies.values()], axis=1)
    points[5:8, :4] = np.nan
    take = read_take(write(points, labels=labels))
    for name, body in take.bodies.items():
        np.testing.assert_allclose(body.measured, bodies[name].measured, atol=1e-6)
        np.testing.assert_array_equal(body.seen, bodies[name].seen)
        assert set(body.missing) <= {SampleStatus.SEEN, SampleStatus.BLANK}
    track = make_track(take, bodies=BodyNames(), axes=Axes())
    assert np.isfinite(track.motion["top_x_m"]).any()


def test_the_content_decides_not_the_name(write: Write, places: NDArray[np.float64]) -> None:
    path = write(places)
    assert read_take(path.rename(path.with_name("x.csv"))).format == "c3d"


def test_an_unknown_unit_is_named(write: Write, places: NDArray[np.float64]) -> None:
    with pytest.raises(TakeError, match="POINT:UNITS is 'furlong'; known are m, "):
        read_take(write(places, unit="furlong"))


def test_points_that_name_no_body_are_reported(write: Write, places: NDArray[np.float64]) -> None:
    take = read_take(write(places, labels=("a", "b", "c", "Unlabeled 1")))
    assert (len(take.bodies), take.cloud.position.shape[1]) == (0, 4)
    assert any("named 'a', 'b', 'c', 'Unlabeled 1': make rigid" in text for text in take.warnings)


@pytest.mark.parametrize(
    ("at", "value", "match"),
    [
        (slice(8, 10), b"\xff\x7f", "the header promises frames 1 to 32767 of 4 points, "),
        (slice(-900, None), b"", r"the file has \d+; cut off"),
        (slice(550, 551), b"\xff", "the parameter at byte 539 is longer than its record; damaged"),
    ],
    ids=["frames", "cut", "parameter"],
)
def test_a_damaged_file_is_refused_before_the_library_sees_it(
    at: slice, value: bytes, match: str, write: Write, places: NDArray[np.float64]
) -> None:
    path = write(places)
    data = bytearray(path.read_bytes())
    data[at] = value
    path.write_bytes(data)
    with pytest.raises(TakeError, match=match) as caught:
        read_take(path)
    assert str(caught.value).startswith(f"{path}: C3D: ")


def test_without_ezc3d_it_says_what_to_install(
    write: Write, places: NDArray[np.float64], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(places)
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    with pytest.raises(TakeError, match=r"pip install hopping-workbench\[c3d\]"):
        read_take(path)


@pytest.fixture
def drawn(tmp_path: Path) -> Callable[..., Take]:
    """Read a file that is written here byte by byte, (n, k, 3) [mm]."""

    def from_points(points: NDArray[np.float64], **how: Any) -> Take:
        path = tmp_path / "drawn.c3d"
        path.write_bytes(c3d_bytes(points, LABELS[: points.shape[1]], **how))
        return read_take(path)

    return from_points


@pytest.mark.parametrize("processor", ["intel", "dec"])
@pytest.mark.parametrize("integers", [False, True])
def test_f7_either_byte_order_is_read_as_whole_numbers_and_as_floats(
    processor: str, integers: bool, drawn: Callable[..., Take], places: NDArray[np.float64]
) -> None:
    take = drawn(1e3 * places, processor=processor, integers=integers, scale=0.0957)
    assert len(take) == FRAMES
    within = 0.06e-3 if integers else 1e-6  # half a step of 0.0957 mm
    np.testing.assert_allclose(take.bodies["Foot"].measured, places[:, :2], atol=within)


@pytest.mark.parametrize("processor", ["intel", "dec"])
@pytest.mark.parametrize("integers", [False, True])
def test_f7_a_cut_file_is_still_told_in_either_byte_order(
    processor: Processor, integers: bool, tmp_path: Path, places: NDArray[np.float64]
) -> None:
    data = c3d_bytes(1e3 * places, LABELS, processor=processor, integers=integers)
    (tmp_path / "x.c3d").write_bytes(data[:-1024])
    with pytest.raises(TakeError, match=r"the header promises frames 1 to 50 .* cut off\?"):
        read_take(tmp_path / "x.c3d")


def test_f7_the_byte_order_that_no_library_reads_is_named(
    drawn: Callable[..., Take], places: NDArray[np.float64]
) -> None:
    with pytest.raises(TakeError, match="its byte order is that of MIPS processors, which is not"):
        drawn(places, processor="mips")


def long_points(count: int) -> NDArray[np.float64]:
    points = np.full((count, 3, 3), 800.0)
    points[:, 0, 0] = np.arange(count)
    points[::2, 0, 1] = 0.0  # no sample repeats the one before
    points[-3, 1] = np.nan
    return points


@pytest.mark.parametrize("count", [65_534, 65_535, 65_536, 70_000])
@pytest.mark.parametrize("processor", ["intel", "dec"])
def test_f4_more_frames_than_the_header_counts_are_read_whole(
    count: int, processor: str, drawn: Callable[..., Take]
) -> None:
    take = drawn(long_points(count), processor=processor, integers=processor == "dec", scale=8.0)
    foot = take.bodies["Foot"].measured
    assert (len(take), take.indices[-1]) == (count, count)
    assert foot[-1, 0, 0] == pytest.approx((count - 1) * 1e-3, abs=4.1e-3)
    assert known(foot[-5:, 1]).tolist() == [True, True, False, True, True]


def test_f4_a_file_that_the_library_writes_is_read_whole(
    write: Write, places: NDArray[np.float64]
) -> None:
    points = np.tile(places[:1], (70_000, 1, 1))
    points[:, 0, 0] = np.linspace(0.1, 0.9, 70_000)
    take = read_take(write(points))
    assert len(take) == 70_000
    np.testing.assert_allclose(take.bodies["Foot"].measured[:, 0], points[:, 0], atol=1e-6)


@pytest.mark.parametrize("processor", ["intel", "dec"])
def test_f4_the_length_that_the_parameters_state_counts(
    processor: str, drawn: Callable[..., Take]
) -> None:
    take = drawn(long_points(70_000), processor=processor, trial=(1, 70_000))
    assert len(take) == 70_000
    with pytest.raises(TakeError, match="promise 80000 frames, there is room for 70000; cut off"):
        drawn(long_points(70_000), processor=processor, trial=(1, 80_000))


@pytest.mark.parametrize("processor", ["intel", "dec"])
@pytest.mark.parametrize("integers", [False, True])
def test_our_reading_of_the_points_is_that_of_the_library(
    processor: Processor, integers: bool, tmp_path: Path, places: NDArray[np.float64]
) -> None:
    data = c3d_bytes(1e3 * places, LABELS, processor=processor, integers=integers)
    (tmp_path / "x.c3d").write_bytes(data)
    peer = ezc3d.c3d(str(tmp_path / "x.c3d"))["data"]["points"][:3].transpose(2, 1, 0)
    np.testing.assert_allclose(read_points(data, read_header(data), FRAMES), peer, atol=1e-4)


def test_axes_that_the_file_names_are_taken_from_it(
    drawn: Callable[..., Take], places: NDArray[np.float64]
) -> None:
    take = drawn(1e3 * places, screen=("-X", "+Z"))
    assert take.axes == Axes(up="z", forward="-x")
    assert not any("usually z-up" in warning for warning in take.warnings)
    for screen in (("+X", "+X"), ("?", "+Z")):
        take = drawn(1e3 * places, screen=screen)
        assert take.axes is None
        assert any("usually z-up" in warning for warning in take.warnings)


def test_f11_a_point_at_exact_zero_is_not_seen(
    drawn: Callable[..., Take], places: NDArray[np.float64]
) -> None:
    places[12, 0] = 0.0
    take = drawn(1e3 * places)
    assert known(take.bodies["Foot"].measured[11:14, 0]).tolist() == [True, False, True]
    told = "points stand at exactly 0, 0, 0 in 1 sample(s), first at frame 13"
    assert any(told in warning for warning in take.warnings)
