"""Record a NatNet stream of Motive into a take, through the package `natnet`.

The stream is read by the package's client in one thread of ours. Motive streams by UDP: frames can
be lost, and the take says which. Bitstreams 3.0 to 4.x (Motive 2 and 3) are read.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from types import ModuleType
from typing import TYPE_CHECKING, Self

from workbench.errors import HardwareError, InputError
from workbench.tracking.natnet_frames import Body, Sample, StreamLayout, make_take
from workbench.tracking.take import Take

if TYPE_CHECKING:
    from natnet import DataDescriptions, DataFrame, NatNetClient

__all__ = ["Recorder", "Stream", "record"]

ANSWER_S = 5.0
"""How long a server may take to answer, and to send its first frame [s]."""

_POLL_S = 0.005
_REPEAT_S = 0.5
_NO_FRAMES_S = 1.0
_OLDEST, _NEWEST = 3, 4  # major versions of the bitstream
_KNOWN_MINOR = 2  # of version 4
_UNREADABLE = (struct.error, ValueError, TypeError)  # what the package raises over wrong bytes


@dataclass(frozen=True)
class Stream:
    """Settings of a stream, as in Motive's streaming pane.

    Args:
        server: address of the tracking PC.
        local: address of this computer that reaches it; found when None.
        multicast: Motive's transmission type; unicast when False.
        group: multicast address.
        command_port: of the server.
        data_port: of a multicast stream.
    """

    server: str = "127.0.0.1"
    local: str | None = None
    multicast: bool = False
    group: str = "239.255.42.99"
    command_port: int = 1510
    data_port: int = 1511

    def __str__(self) -> str:
        """Name the server for messages."""
        return f"{self.server}:{self.command_port}"


def record(stream: Stream, seconds: float, answer: float = ANSWER_S) -> Take:
    """Record a stream for some time.

    Args:
        stream: settings.
        seconds: from the first frame on [s].
        answer: longest wait for the server and for the first frame [s].

    Raises:
        InputError: when the package `natnet` is not installed.
        HardwareError: when no server answers, or what it sends cannot be used.
    """
    with Recorder(stream, answer) as recorder:
        time.sleep(seconds)
        return recorder.stop()


class Recorder:
    """Records from `start` to `stop`; `stop` and `close` release thread and sockets.

    Args:
        stream: settings.
        answer: longest wait for the server and for the first frame [s].
    """

    def __init__(self, stream: Stream, answer: float = ANSWER_S) -> None:
        self._stream, self._answer = stream, answer
        self._client: NatNetClient | None = None
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._layout: StreamLayout | None = None
        self._samples: list[Sample] = []
        self._news = threading.Condition()
        self._began = datetime.min
        self._last = 0.0
        self._damaged = 0
        self._version = ""
        self._warnings: list[str] = []

    def __enter__(self) -> Self:
        """Start recording."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Release thread and sockets."""
        self.close()

    def start(self) -> None:
        """Return when the first frame was recorded; the others follow in a thread.

        Raises:
            InputError: when the package `natnet` is not installed.
            HardwareError: when no server answers, or what it sends cannot be used.
        """
        try:
            self._client = self._connected()
            self._wait(self._describe, lambda: self._layout is not None, _NO_MODELS)
            self._wait(lambda: None, lambda: bool(self._samples), _NO_FRAMES)
        except BaseException:
            self.close()
            raise
        self._thread = threading.Thread(target=self._run, name="natnet recorder", daemon=True)
        self._thread.start()

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Return the stream's bodies, none before it was started."""
        return () if self._layout is None else self._layout.bodies

    def since(self, count: int, wait_s: float = 0.0) -> list[Sample]:
        """Return the frames after the first `count`, so far; safe in any thread.

        Args:
            count: of frames that are known.
            wait_s: for how long to wait for the next one [s].
        """
        with self._news:
            self._news.wait_for(lambda: len(self._samples) > count, wait_s)
        return self._samples[count:]

    def stop(self) -> Take:
        """Stop recording and return the take: format "natnet", nothing written.

        Raises:
            HardwareError: when too few frames came.
        """
        without_frames = time.monotonic() - self._last
        self.close()
        if self._layout is None or not self._samples:
            raise HardwareError(f"{self._stream}: nothing was recorded; start the recorder first")
        warnings = list(self._warnings)
        if without_frames > _NO_FRAMES_S:
            warnings.append(
                f"the stream ended {without_frames:.1f} s before the recording was stopped"
            )
        if self._damaged:
            warnings.append(f"{self._damaged} packet(s) could not be read")
        return make_take(self._samples, self._layout, self._version, self._began, warnings)

    def close(self) -> None:
        """End the thread and close the sockets; recorded frames stay."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
        if self._client is not None:
            self._client.shutdown()
        self._thread = self._client = None

    def _connected(self) -> NatNetClient:
        stream, natnet = self._stream, _natnet()
        client = natnet.NatNetClient(
            stream.server,
            _local_address(stream),
            stream.group,
            stream.command_port,
            stream.data_port,
            stream.multicast,
        )
        client.on_data_description_received_event.handlers.append(self._take_models)
        client.on_data_frame_received_event.handlers.append(self._take_frame)
        try:
            client.connect(self._answer)
            self._check_version(client)
        except BaseException as error:
            client.shutdown()
            if isinstance(error, (OSError, natnet.NatNetError)):
                raise HardwareError(_no_answer(stream, self._answer, error)) from error
            if isinstance(error, _UNREADABLE):
                raise HardwareError(f"{stream}: what answers is no NatNet server") from error
            raise
        return client

    def _check_version(self, client: NatNetClient) -> None:
        info = client.server_info
        if info is None:
            raise HardwareError(f"{self._stream}: the server does not say what it is")
        found = info.nat_net_protocol_version
        self._version = f"{found.major}.{found.minor}"
        if not _OLDEST <= found.major <= _NEWEST:
            raise HardwareError(
                f"{self._stream}: {info.application_name} streams NatNet {self._version}; read are "
                f"{_OLDEST}.0 to {_NEWEST}.x, Motive 2 and 3{_instead(found.major)}"
            )
        if found.major == _NEWEST and found.minor > _KNOWN_MINOR:
            self._warnings.append(
                f"the stream is NatNet {self._version}, newer than {_NEWEST}.{_KNOWN_MINOR}, which "
                "is known; look at the numbers before you trust them"
            )

    def _describe(self) -> None:
        if self._client is not None:
            self._client.request_modeldef()

    def _wait(self, ask: Callable[[], None], done: Callable[[], bool], failure: str) -> None:
        """Ask repeatedly and read packets until `done`; raise `failure` after a while."""
        deadline, again = time.monotonic() + self._answer, 0.0
        while not done():
            now = time.monotonic()
            if now > deadline:
                raise HardwareError(f"{self._stream}: {failure}")
            if now >= again:
                again = now + _REPEAT_S
                ask()
            error = self._read()
            if isinstance(error, UnicodeDecodeError) and _is_name(error.object):
                raise HardwareError(
                    f"{self._stream}: a name in the stream is not UTF-8 ({error.object!r}); rename "
                    "that rigid body, skeleton or marker set in Motive with plain letters"
                ) from error
            if error:
                raise HardwareError(
                    f"{self._stream}: packets do not fit NatNet {self._version}, which the server "
                    f"says that it streams ({error}); update Motive, or the package natnet"
                ) from error
            time.sleep(_POLL_S)

    def _run(self) -> None:
        while not self._stopping.wait(_POLL_S):
            if self._read():
                self._damaged += 1

    def _read(self) -> Exception | None:
        """Read all packets in the buffer; return the error of a damaged one."""
        if self._client is None:
            return None
        try:
            self._client.update_sync()
        except OSError:  # on Windows a closed port of the server; `_wait` and `stop` report it
            return None
        except (_natnet().NatNetError, *_UNREADABLE) as error:
            return error
        return None

    def _take_models(self, found: DataDescriptions) -> None:
        if self._layout is not None:
            return
        if not found.rigid_bodies:
            raise HardwareError(
                f"{self._stream}: the stream has no rigid bodies; make them in Motive and switch "
                "on Rigid Bodies in its streaming pane"
            )
        self._layout = StreamLayout(found.rigid_bodies)

    def _take_frame(self, frame: DataFrame) -> None:
        if self._layout is None:
            return
        sample = self._layout.sample(frame)
        if not self._samples:
            self._began = datetime.now()
        with self._news:
            self._samples.append(sample)
            self._news.notify_all()
        self._last = time.monotonic()


_NO_MODELS = "the server answers but sends no model definitions; switch on Rigid Bodies in Motive"
_NO_FRAMES = (
    "the server answers but sends no frames; is Motive live or playing, is streaming on, does a "
    "firewall of this computer stop UDP, is the transmission type the same here and in Motive?"
)


def _is_name(text: bytes) -> bool:
    """Return whether bytes that are not UTF-8 look like a name in some code page of Windows.

    Packets of another version are read at wrong offsets, of lengths and coordinates.
    """
    low = sum(byte < 0x20 or byte == 0x7F for byte in text)
    letters = sum(chr(byte).isalnum() or byte in b" _-." for byte in text)
    return len(text) > 1 and low == 0 and letters >= len(text) / 2


def _instead(major: int) -> str:
    """Return advice for a version that is not supported."""
    if major >= _OLDEST:
        return ""
    return (
        ". Motive 1 streams it: upgrade to Motive 2 or later, or export its takes as CSV, which "
        "`workbench ingest` reads"
    )


def _no_answer(stream: Stream, answer: float, error: BaseException) -> str:
    kind = "multicast" if stream.multicast else "unicast"
    words = " ".join(str(error).split())
    cause = f" ({words})" if words else ""
    return (
        f"no NatNet server answers at {stream} within {answer:g} s{cause}; is streaming on in "
        f"Motive, with {kind} and the interface that this computer reaches; does a firewall stop "
        f"UDP ports {stream.command_port} and {stream.data_port}; is the local address right?"
    )


def _local_address(stream: Stream) -> str:
    """Return this computer's address on the way to the server; no packet is sent for it."""
    if stream.local is not None:
        return stream.local
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((stream.server, stream.command_port))
        except OSError as error:
            raise HardwareError(
                f"{stream}: no way to this server ({error}); is its name right, is the network "
                "connected? Its address, such as 192.168.1.10, does as well"
            ) from error
        return str(probe.getsockname()[0])


def _natnet() -> ModuleType:
    try:
        import natnet
    except ModuleNotFoundError:
        raise InputError(
            "a stream needs the package natnet; pip install hopping-workbench[live]"
        ) from None
    return natnet
