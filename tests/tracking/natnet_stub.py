"""A server that streams NatNet on loopback, and the bytes of a take as Motive would stream it.

`python -m tests.tracking.natnet_stub` writes the recorded streams of tests/data/natnet.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Self

import numpy as np
from scipy.spatial.transform import Rotation

from workbench.tracking import BodyTake, Take

Version = tuple[int, int]

STREAMS = Path(__file__).parents[1] / "data" / "natnet"
VERSIONS: tuple[Version, ...] = ((3, 1), (4, 0), (4, 1), (4, 2))
CONNECT, SERVER_INFO, MODEL_REQUEST, MODELS, FRAME = 0, 1, 4, 5, 7
FIRST_FRAME = 71_000
CLOCK_S = 512.25  # of the server when the first frame was taken
TRACKED, SOLVED, OCCLUDED, HAS_MODEL, UNLABELED = 0x01, 0x02, 0x01, 0x08, 0x10


def message(kind: int, payload: bytes) -> bytes:
    return struct.pack("<HH", kind, len(payload)) + payload


def server_info(version: Version, name: str = "Motive") -> bytes:
    text = name.encode().ljust(256, b"\0")
    tail = struct.pack("<QHB4B", 10_000_000, 1511, 0, 239, 255, 42, 99)
    return message(SERVER_INFO, text + bytes((3, 1, 0, 0, *version, 0, 0)) + tail)


def models(take: Take, version: Version, mirrored: bool = False) -> bytes:
    """Return the model definitions, as Motive 2.1 sends them with x mirrored if asked for."""
    datasets = [
        struct.pack("<I", 1) + _sized(_model(body, version, mirrored), version)
        for body in take.bodies.values()
    ]
    return message(MODELS, struct.pack("<I", len(datasets)) + b"".join(datasets))


def frames(take: Take, version: Version, ticks: int = 0, timecode: int = 0) -> list[bytes]:
    """Return the frames; `ticks` of the clock per second stamp the exposures, none where 0."""
    errors = [np.nan_to_num(body.fit_error) for body in take.bodies.values()]  # all at once
    return [
        message(FRAME, _frame(take, k, version, ticks, timecode, errors)) for k in range(len(take))
    ]


def recording(take: Take, version: Version) -> bytes:
    """Return all packets of a stream one behind the other."""
    return server_info(version) + models(take, version) + b"".join(frames(take, version))


def packets(data: bytes) -> list[bytes]:
    """Return the packets of a recording."""
    found: list[bytes] = []
    while data:
        size = 4 + struct.unpack_from("<HH", data)[1]
        found.append(data[:size])
        data = data[size:]
    return found


def _sized(data: bytes, version: Version) -> bytes:
    """Put the size before a data set, as versions from 4.1 on do."""
    return struct.pack("<I", len(data)) + data if version >= (4, 1) else data


def _listed(items: Sequence[bytes], version: Version) -> bytes:
    return struct.pack("<I", len(items)) + _sized(b"".join(items), version)


def _model(body: BodyTake, version: Version, mirrored: bool) -> bytes:
    count = len(body.marker_names)
    data = body.name.encode() + b"\0" + struct.pack("<Ii3f", int(body.id), -1, 0, 0, 0)
    if version >= (4, 2):
        data += struct.pack("<4f", 0, 0, 0, 1)
    places = _places(body) * ([-1, 1, 1] if mirrored else 1)
    data += struct.pack("<I", count) + places.astype("<f4").tobytes()
    data += struct.pack(f"<{count}I", *range(1, count + 1))
    if version >= (4, 0):
        data += b"".join(f"Marker{k + 1}".encode() + b"\0" for k in range(count))
    return data


def _places(body: BodyTake) -> np.ndarray:
    """Return where the markers sit on a body, (m, 3), from its first sample."""
    turn = Rotation.from_quat(body.quaternion[0], scalar_first=True)
    return turn.inv().apply(body.solved[0] - body.position[0])


def _frame(
    take: Take, k: int, version: Version, ticks: int, timecode: int, errors: list[np.ndarray]
) -> bytes:
    none = _listed([], version)
    loose = [p for p in take.cloud.position[k] if np.isfinite(p).all()]
    data = struct.pack("<I", FIRST_FRAME + int(take.indices[k])) + none
    data += _listed([struct.pack("<3f", *p) for p in loose], version)
    poses = zip(take.bodies.values(), errors, strict=True)
    data += _listed([_pose(body, k, error) for body, error in poses], version)
    data += none  # skeletons
    data += none if version >= (4, 1) else b""  # assets
    markers = [m for body in take.bodies.values() for m in _markers(body, k)]
    markers += [_marker(1007, p, SOLVED | UNLABELED) for p in loose]
    data += _listed(markers, version) + none + none
    time_s = CLOCK_S + float(take.times[k] - take.times[0])
    late = {1: -0.004, 2: 0.0, 3: 0.001}  # middle of the exposure, received, sent
    stamps = [round(ticks * (time_s + s)) if ticks else place for place, s in late.items()]
    data += struct.pack("<IId3QH", timecode, 0, time_s, *stamps, 0)
    return data + bytes(4)


def _pose(body: BodyTake, k: int, errors: np.ndarray) -> bytes:
    """Return a pose; while a body is lost Motive repeats the last one and says that it is lost."""
    tracked = bool(np.isfinite(body.position[k]).all())
    while not np.isfinite(body.position[k]).all():
        k -= 1
    (w, x, y, z), error = body.quaternion[k], errors[k]
    return struct.pack("<i3f4ffH", int(body.id), *body.position[k], x, y, z, w, error, tracked)


def _markers(body: BodyTake, k: int) -> Iterator[bytes]:
    for slot, place in enumerate(body.measured[k]):
        number = (int(body.id) << 16) + slot + 1
        if np.isfinite(place).all():
            yield _marker(number, place, SOLVED | HAS_MODEL)
        else:  # where the model would have it
            yield _marker(number, body.solved[k, slot], OCCLUDED | HAS_MODEL)


def _marker(number: int, place: np.ndarray, flags: int) -> bytes:
    return struct.pack("<I3ffHf", number, *place, 0.012, flags, 0.0001)


class StubServer:
    """Answers and streams in a thread; frames go to whoever asked for the models.

    Args:
        sent: the packets of a recording, in order; the first is the server's answer.
        pause_s: between frames.
        mute: kinds of packets that it keeps to itself.

    Attributes:
        sent_s: when each frame was sent, by `time.monotonic()`.
    """

    def __init__(
        self, sent: Sequence[bytes], pause_s: float = 0.002, mute: tuple[int, ...] = ()
    ) -> None:
        kinds = [struct.unpack_from("<H", packet)[0] for packet in sent]
        self._answers = dict(zip(kinds[:2], sent[:2], strict=True))
        self._frames = [] if FRAME in mute else list(sent[2:])
        self._pause_s, self._mute = pause_s, mute
        self._stop = threading.Event()
        self.sent_s: list[float] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
        self.port: int = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        self._thread.join()
        self._socket.close()

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                asked, client = self._socket.recvfrom(4096)
            except (TimeoutError, ConnectionResetError):
                continue
            kind = struct.unpack_from("<H", asked)[0]
            if kind == CONNECT:
                self._answer(SERVER_INFO, client)
            elif kind == MODEL_REQUEST:
                self._answer(MODELS, client)
                self._stream(client)

    def _answer(self, kind: int, client: tuple[str, int]) -> None:
        if kind not in self._mute:
            self._socket.sendto(self._answers[kind], client)

    def _stream(self, client: tuple[str, int]) -> None:
        begun = time.monotonic()
        for k, packet in enumerate(self._frames):
            time.sleep(max(begun + k * self._pause_s - time.monotonic(), 0.0))
            if self._stop.is_set():
                break
            self.sent_s.append(time.monotonic())
            self._socket.sendto(packet, client)
        self._frames = []


def write_recordings() -> None:
    from tests.tracking.conftest import small_take

    STREAMS.mkdir(exist_ok=True)
    for version in VERSIONS:
        name = "hop_{}.{}.bin".format(*version)
        (STREAMS / name).write_bytes(recording(small_take(), version))


if __name__ == "__main__":
    write_recordings()
