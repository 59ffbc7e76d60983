"""A recorded stream, played by a server on loopback, becomes the take that Motive exports."""

from __future__ import annotations

import struct
import sys
import threading
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from natnet import DataFrame
from natnet.packet_buffer import PacketBuffer
from natnet.version import Version

from tests.tracking.natnet_stub import (
    FRAME,
    MODELS,
    SERVER_INFO,
    STREAMS,
    VERSIONS,
    StubServer,
    frames,
    packets,
    recording,
    server_info,
)
from workbench.errors import HardwareError, InputError
from workbench.tracking import Recorder, SampleStatus, Stream, Take, read_take, record, write_motive

SECONDS = 0.4  # the stub sends its 40 frames in about 0.1 s
ANSWER_S = 0.3
CSV_DIGITS_M = 1e-6
FIELDS = ("position", "quaternion", "measured", "solved")


def recorded(version: str = "4.1") -> list[bytes]:
    return packets((STREAMS / f"hop_{version}.bin").read_bytes())


def played(sent: list[bytes], seconds: float = SECONDS) -> Take:
    with StubServer(sent) as server:
        return record(Stream(command_port=server.port), seconds, answer=2.0)


def assert_same_motion(found: Take, expected: Take) -> None:
    assert found.rate_hz == expected.rate_hz
    np.testing.assert_array_equal(found.indices, expected.indices)
    np.testing.assert_allclose(found.times, expected.times, atol=1e-9)
    assert list(found.bodies) == list(expected.bodies)
    for name, body in expected.bodies.items():
        other = found.bodies[name]
        assert other.marker_names == body.marker_names
        np.testing.assert_array_equal(other.seen, body.seen)
        for field in FIELDS:
            np.testing.assert_allclose(
                getattr(other, field), getattr(body, field), rtol=0, atol=CSV_DIGITS_M
            )


@pytest.fixture(autouse=True)
def nothing_left_running() -> object:
    """No recorder's thread outlives its test; open sockets are warnings, which are errors."""
    yield
    names = [thread.name for thread in threading.enumerate()]
    assert "natnet recorder" not in names


@pytest.mark.parametrize("version", ["{}.{}".format(*v) for v in VERSIONS])
def test_a_stream_has_the_numbers_of_the_export_of_the_same_take(
    version: str, stored: Path
) -> None:
    take = played(recorded(version))
    assert (take.format, take.version, take.warnings) == ("natnet", version, ())
    expected = read_take(stored / "hop_motive_1.24.csv")
    assert_same_motion(take, expected)
    np.testing.assert_allclose(
        take.cloud.position, expected.cloud.position, rtol=0, atol=CSV_DIGITS_M
    )
    assert take.cloud.names[12, 0] == "Unlabeled 1007"
    assert take.jitter_s < 1e-9


@pytest.mark.parametrize("version", VERSIONS)
def test_the_stored_streams_are_those_of_the_small_take(
    version: tuple[int, int], small: Take
) -> None:
    stored = (STREAMS / "hop_{}.{}.bin".format(*version)).read_bytes()
    assert stored == recording(small, version)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_stub_s_frames_are_read_to_their_last_byte(
    version: tuple[int, int], small: Take
) -> None:
    for packet in frames(small, version):
        buffer = PacketBuffer(packet)
        buffer.pointer = 4
        DataFrame.read_from_buffer(buffer, Version(*version))
        # the end mark of 4 bytes, and on Windows what its shorter `long` leaves of three stamps
        assert len(buffer.data) - buffer.pointer - 4 in (0, 12)


def test_a_lost_body_is_lost_in_the_take_and_keeps_no_stale_pose() -> None:
    body = played(recorded()).bodies["Foot"]
    assert list(np.flatnonzero(body.missing == SampleStatus.LOST)) == [5, 6, 7]
    for field in FIELDS:
        assert np.isnan(getattr(body, field)[5:8]).all()


def test_the_take_can_be_kept_as_an_export(tmp_path: Path) -> None:
    take = played(recorded())
    write_motive(take, tmp_path / "live.csv", version="1.24")
    again = read_take(tmp_path / "live.csv")
    assert_same_motion(again, take)
    (began,) = again.began
    assert abs((began - take.began[0]).total_seconds()) < 0.001


def test_the_mean_marker_error_of_the_stream_is_told(small: Take) -> None:
    told = float(played(recorded()).header["Mean Marker Error of Foot [m]"])
    expected = np.mean(small.bodies["Foot"].fit_error[small.bodies["Foot"].seen])
    assert told == pytest.approx(expected, abs=1e-6)


def test_frames_that_get_lost_are_steps_of_the_index_and_told() -> None:
    info, models, *sent = recorded()
    del sent[25], sent[10:13]
    take = played([info, models, *sent])
    missing = set(range(40)) - set(take.indices.tolist())
    assert missing == {10, 11, 12, 25}
    assert take.rate_hz == 120
    assert take.warnings == (
        "4 of 40 frames did not arrive, at most 3 in a row; is the network wireless or busy?",
    )


def test_frames_out_of_order_and_twice_are_put_right_and_told(stored: Path) -> None:
    info, models, *sent = recorded()
    sent[7], sent[8] = sent[8], sent[7]
    take = played([info, models, *sent, sent[3]])
    assert_same_motion(take, read_take(stored / "hop_motive_1.24.csv"))
    assert take.warnings == (
        "1 frame(s) came twice; the first counts",
        "frames came out of order, or Motive played a take in a loop; sorted by number",
    )


def test_a_jittering_clock_is_reported() -> None:
    info, models, *sent = recorded()
    rng = np.random.default_rng(3)
    shift = rng.normal(0, 2e-4, len(sent))
    sent = [_shifted(packet, s) for packet, s in zip(sent, shift, strict=True)]
    take = played([info, models, *sent])
    assert take.rate_hz == pytest.approx(120, abs=0.3)
    assert take.jitter_s == pytest.approx(np.std(np.diff(shift)), rel=0.1)


def _shifted(packet: bytes, by: float) -> bytes:
    place = len(packet) - 4 - 2 - 24 - 8  # before end mark, parameters, three stamps
    (time_s,) = struct.unpack_from("<d", packet, place)
    return packet[:place] + struct.pack("<d", time_s + by) + packet[place + 8 :]


def test_a_stream_that_ends_early_is_told() -> None:
    take = played(recorded(), seconds=1.5)
    assert len(take) == 40
    assert "the stream ended 1." in take.warnings[0]


def test_one_frame_gives_no_rate() -> None:
    with pytest.raises(HardwareError, match=r"no rate can be found from 1 frame\(s\)"):
        played(recorded()[:3])


def test_a_damaged_packet_within_the_stream_is_left_out_and_told() -> None:
    info, models, *sent = recorded()
    sent[20] = sent[20][:200]
    sent[20] = sent[20][:2] + struct.pack("<H", 196) + sent[20][4:]
    take = played([info, models, *sent])
    assert len(take) == 39
    assert take.warnings[0] == "1 packet(s) could not be read"


@pytest.mark.parametrize(
    ("mute", "told"),
    [
        (
            (SERVER_INFO,),
            r"no NatNet server answers at 127\.0\.0\.1:\d+ within 0\.3 s; is "
            r"streaming on in Motive, with unicast .* firewall .* local address",
        ),
        ((MODELS,), r"127\.0\.0\.1:\d+: the server answers but sends no model definitions"),
        ((FRAME,), r"the server answers but sends no frames; is Motive live or playing"),
    ],
)
def test_silence_is_told_with_what_to_look_at(mute: tuple[int, ...], told: str) -> None:
    with StubServer(recorded(), mute=mute) as server, pytest.raises(HardwareError, match=told):
        record(Stream(command_port=server.port), SECONDS, answer=ANSWER_S)


def test_nobody_at_the_port_and_no_such_local_address_are_told() -> None:
    with pytest.raises(HardwareError, match=r"no NatNet server answers at 127\.0\.0\.1:9"):
        record(Stream(command_port=9), SECONDS, answer=ANSWER_S)
    with pytest.raises(HardwareError, match=r"no NatNet server answers .*is the local address"):
        record(Stream(local="192.0.2.1"), SECONDS, answer=ANSWER_S)


def other_version(stream: Mapping[str, str]) -> list[bytes]:
    """Packets of one version behind the answer of a server that tells another."""
    said = tuple(int(k) for k in stream["said"].split("."))
    return [server_info((said[0], said[1])), *recorded(stream["sent"])[1:]]


@pytest.mark.parametrize(
    ("said", "sent"), [("3.1", "4.1"), ("4.0", "4.2"), ("4.1", "4.0"), ("4.2", "3.1")]
)
def test_a_stream_of_another_version_than_was_said_is_refused(said: str, sent: str) -> None:
    told = rf"packets do not fit NatNet {said}, which the server says .*\)"
    with pytest.raises(HardwareError, match=told):
        played(other_version({"said": said, "sent": sent}))


def test_a_version_that_cannot_be_read_is_refused_and_a_newer_one_noted() -> None:
    old = [server_info((2, 10)), *recorded()[1:]]
    with pytest.raises(HardwareError, match=r"Motive streams NatNet 2\.10; read are 3\.0 to 4\.x"):
        played(old)
    newer = played([server_info((4, 7)), *recorded("4.2")[1:]])
    assert "the stream is NatNet 4.7, newer than 4.2, which is known" in newer.warnings[0]


def test_a_stream_without_bodies_is_refused() -> None:
    none = struct.pack("<HHI", MODELS, 4, 0)
    with pytest.raises(HardwareError, match="the stream has no rigid bodies; make them in Motive"):
        played([recorded()[0], none, *recorded()[2:]])


def test_a_recorder_that_was_not_started_has_nothing() -> None:
    with pytest.raises(HardwareError, match="nothing was recorded"):
        Recorder(Stream()).stop()


def test_without_the_extra_it_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "natnet", None)
    with pytest.raises(InputError, match=r"pip install hopping-workbench\[live\]"):
        record(Stream(), 0.1)
