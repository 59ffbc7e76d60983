"""What real servers stream that the definition of the bitstream does not say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.tracking.natnet_stub import StubServer, frames, models, server_info
from workbench.errors import HardwareError
from workbench.tracking import BodyTake, Cloud, SampleStatus, Stream, Take, record

SECONDS = 0.4
PLACES = np.array([[0.05, 0.0, 0.02], [-0.03, 0.01, 0.0], [0.0, -0.01, -0.06]])
MIDDLE = np.array([0.1, 0.2, 0.3])
OLD = (3, 0)


def still(places: NDArray[np.float64] = PLACES, n: int = 40) -> Take:
    """Return a body at (0.1, 0.2, 0.3), not turned, whose markers scatter by 0.2 mm."""
    noise = np.random.default_rng(2).normal(0, 2e-4, (n, len(places), 3))
    solved = np.broadcast_to(MIDDLE + places, noise.shape)
    foot = BodyTake(
        name="Foot",
        id="1",
        position=np.tile(MIDDLE, (n, 1)),
        quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        measured=solved + noise,
        solved=solved,
        marker_names=tuple(f"Marker {k + 1}" for k in range(len(places))),
        missing=np.zeros(n, dtype=np.int8),
    )
    return Take(
        path="", sha256="", format="motive", version="", rate_hz=120.0, jitter_s=0.0,
        indices=np.arange(n), times=np.arange(n) / 120, bodies={"Foot": foot},
        cloud=Cloud.empty(n),
    )  # fmt: skip


def streamed(take: Take, *, mirrored: bool = False, ticks: int = 0, timecode: int = 0) -> Take:
    sent = [server_info(OLD), models(take, OLD, mirrored), *frames(take, OLD, ticks, timecode)]
    with StubServer(sent) as server:
        return record(Stream(command_port=server.port), SECONDS, answer=2.0)


def test_f5_model_places_with_x_mirrored_are_put_right_and_told() -> None:
    found = streamed(still(), mirrored=True)
    np.testing.assert_allclose(found.bodies["Foot"].solved[0, :, 0], [0.15, 0.07, 0.1], atol=1e-6)
    assert np.nanmean(found.bodies["Foot"].fit_error) < 5e-4
    (told,) = found.warnings
    assert told.startswith("the stream's model of 'Foot' has x mirrored, as Motive 2.1 sends it: ")
    assert "lay 60.0 mm from the measured ones (median), and 0.3 mm are streamed" in told


def test_f5_a_model_that_fits_is_left_alone() -> None:
    found = streamed(still())
    np.testing.assert_allclose(found.bodies["Foot"].solved[0], PLACES + MIDDLE, atol=1e-6)
    assert found.warnings == ()


def test_f5_a_model_that_fits_in_no_mirror_is_told() -> None:
    take = still()
    foot = take.bodies["Foot"]
    moved = replace(foot, measured=foot.measured + np.array([0, 0.04, 0]))
    found = streamed(replace(take, bodies={"Foot": moved}))
    assert (
        "the solved markers of 'Foot' lie 40.0 mm (median) from the measured" in found.warnings[0]
    )


def test_f11_a_streamed_marker_at_exact_zero_is_not_seen() -> None:
    take = still()
    measured = take.bodies["Foot"].measured.copy()
    measured[7, 1] = 0.0
    foot = replace(take.bodies["Foot"], measured=measured)
    found = streamed(replace(take, bodies={"Foot": foot}))
    assert np.isnan(found.bodies["Foot"].measured[7, 1]).all()
    assert found.bodies["Foot"].missing[7] == SampleStatus.SEEN
    assert "markers of 'Foot' stand at exactly 0, 0, 0 in 1 sample(s)" in found.warnings[0]


def test_f15_a_name_that_is_not_utf_8_is_named() -> None:
    take = still()
    named = models(take, OLD).replace(b"Foot\0", b"Fu\xdf \0")
    words = r"a name in the stream is not UTF-8 \(b'Fu\\xdf.*'\); rename that rigid body, "
    sent = [server_info(OLD), named, *frames(take, OLD)]
    with StubServer(sent) as server, pytest.raises(HardwareError, match=words):
        record(Stream(command_port=server.port), SECONDS, answer=0.5)


def test_an_old_motive_is_named_as_what_to_upgrade() -> None:
    take = still()
    sent = [server_info((2, 9)), models(take, OLD), *frames(take, OLD)]
    words = r"NatNet 2\.9; read are 3\.0 .*Motive 1 streams it: upgrade to Motive 2 or later, or"
    with StubServer(sent) as server, pytest.raises(HardwareError, match=words):
        record(Stream(command_port=server.port), SECONDS, answer=0.5)


def test_the_timecode_of_the_stream_is_kept() -> None:
    found = streamed(still(), ticks=10_000_000, timecode=0x01020304)
    assert found.header["Timecode"] == "01:02:03:04"
    plain = streamed(still())
    assert "Timecode" not in plain.header
