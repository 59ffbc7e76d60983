"""A stub that plays bytes from a script: what no simulated device would ever send."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from workbench.hw import Connection, SimulatedSupply

QUICK_S = 0.1  # so that a test of silence is short
PAUSE_S = 0.02

Script = Sequence[tuple[str, str]]  # (expected request, reply) in hex; "|" is a short pause
Play = Callable[[Script], Connection]


@contextmanager
def played(script: Script) -> Iterator[Connection]:
    """Serve a script to one client; afterwards the requests must have been the expected ones."""
    heard: list[str] = []
    hung_up = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=_answer, args=(listener, script, heard, hung_up))
        thread.start()
        port = listener.getsockname()[1]
        yield Connection("rtu-over-tcp", f"127.0.0.1:{port}", timeout_s=QUICK_S)
        hung_up.set()
        thread.join(10)
    assert heard == [request for request, _ in script]


def _answer(
    listener: socket.socket, script: Script, heard: list[str], hung_up: threading.Event
) -> None:
    listener.settimeout(5)
    link, _ = listener.accept()
    with link:
        link.settimeout(5)
        for request, reply in script:
            heard.append(link.recv(len(bytes.fromhex(request))).hex(" "))
            for pause, piece in enumerate(reply.split("|")):
                time.sleep(pause * PAUSE_S)
                link.sendall(bytes.fromhex(piece))
        hung_up.wait(5)


class AtOnce:
    """A channel to a simulated supply that answers in the client's own thread.

    Args:
        device: what answers.
    """

    def __init__(self, device: SimulatedSupply) -> None:
        self.wire = device.wire("rtu")
        self.coming: list[bytes] = []

    def send(self, data: bytes) -> None:
        self.coming += [answer.data for answer in self.wire.receive(data)]

    def receive(self, seconds: float) -> bytes:
        return self.coming.pop(0) if self.coming else b""

    def close(self) -> None:
        self.coming.clear()
