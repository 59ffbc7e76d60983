"""Lose a supply in every way while it drives, and let it tell by itself when its output was off.

The supplies are stubs that share nothing with the product (`tests/hw/foreign.py`), behind a line
that can be lost; client and guardian are real processes. `benchmarks/losses.py` prints the table.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.hw.foreign import Foreign, Hmp4040, Ka3005p, Rd6006, crc
from tests.hw.guardian_rig import ProcessorWait
from workbench.output import fold

__all__ = ["CASES", "CLIENTS", "KINDS", "WAYS", "Case", "Lost", "lose_many", "lose_one", "table"]

KINDS = (
    "silence",
    "unplugged",
    "stalled",
    "flood",
    "damaged",
    "foreign",
    "slow",
    "echo",
    "exception",
)
WAYS = ("riden pty", "riden rtu-over-tcp", "riden tcp", "korad pty", "korad tcp", "scpi tcp")
CLIENTS = ("alive", "killed", "hung")
BAR_S = 1.0
LOST_S = 2.5  # how long the supply is away
SLOW_S = 3.0
DRIVEN_S = 0.6  # before it is lost
ENDS_S = 30.0
KEEP_TRYING_S = 15.0  # more than a case needs
AT_ONCE = 4
POLL_S = 0.01
VOLTS = "2.5"
FLOOD = b"\x55\xaa" * 64

CLIENT = """
    import sys
    from decimal import Decimal
    from pathlib import Path
    from workbench.hw import Connection, Limits, prepare, switch_on, watch
    from workbench.hw.guardian import LeaseClock, Records, open_guarded
    family, kind, address, model, folder = sys.argv[1:6]
    clock, place = LeaseClock(), Connection(kind, address, baud=9600)
    records = Records(Path(folder) / "wire.log", Path(folder) / "guardian.jsonl")
    with open_guarded(
        place, clock=clock, records=records, family=family, keep_trying_s=float(sys.argv[6])
    ) as supply:
        prepare(supply, Limits(*map(Decimal, ("6", "1", "6.5", "1.2"))), model=model)
        switch_on(supply, Decimal(sys.argv[7]))
        print("on", flush=True)
        while True:
            clock.sleep(0.2)
            watch(supply)
"""


@dataclass(frozen=True)
class Case:
    """One way to lose a supply.

    Args:
        kind: of `KINDS`.
        way: of `WAYS`: family and transport.
        client: of `CLIENTS`.
    """

    kind: str
    way: str
    client: str

    def __str__(self) -> str:
        """Name it for people."""
        return f"{self.kind}, {self.way}, client {self.client}"


CASES = [
    Case(*words)
    for words in itertools.product(KINDS, WAYS, CLIENTS)
    if words[:2] != ("echo", "riden tcp")
]
"""Every kind on every way; only RS485 echoes, and a gateway to Modbus TCP hears that by itself."""


@dataclass
class Lost:
    """What became of one case.

    Args:
        case: it.
        reported_s: when a person could read that the output may be on, after the loss [s].
        cause: the words in which that was reported first.
        off_s: for how long the terminals were live after the supply was back [s]; 0 when they
            were dead before.
        report_waited_s: for how long guardian, client and this process waited for a processor from
            the loss until it was reported [s]: idle, 0.
        off_waited_s: the same, from the return until off.
        false_off: what the record said while the terminals were live, if it said off.
        state: what the record says at the end.
        live: whether the terminals are at the end.
        output: of client and guardian at the terminal, with times after the loss [s].
    """

    case: Case
    reported_s: float = float("inf")
    cause: str = ""
    off_s: float = float("inf")
    report_waited_s: float = 0.0
    off_waited_s: float = 0.0
    false_off: str = ""
    state: str = ""
    live: bool = True
    output: list[str] = field(default_factory=list)

    @property
    def right(self) -> bool:
        """Whether all bars are held."""
        known = self.state == "off" or (self.state == "unknown" and self.case.kind == "foreign")
        reported = self.reported_s <= BAR_S + self.report_waited_s
        reported = reported or (self.case.client != "alive" and self.off_s == 0)
        off = self.off_s <= BAR_S + self.off_waited_s
        return reported and off and not self.false_off and not self.live and known


class LossyLine:
    """A stub supply behind a line that can be lost.

    Args:
        make: makes the stub.
        family: `riden`, `korad` or `scpi`.
        transport: `pty`, `rtu-over-tcp` or `tcp`.
        folder: where the link to a pseudo terminal lies.
    """

    def __init__(
        self, make: Callable[[], Foreign], family: str, transport: str, folder: Path
    ) -> None:
        self.stub, self.stranger = make(), make()
        _estrange(self.stranger)
        self.loss = ""
        self.family, self._mbap = family, family == "riden" and transport == "tcp"
        self.lock = threading.Lock()
        self._stop = threading.Event()
        self._pty = transport == "pty"
        self._link = folder / "port"
        self._ours = self._theirs = -1
        self._listener: socket.socket | None = None
        self._port = 0
        self.plug_in()
        self.address = str(self._link) if self._pty else f"127.0.0.1:{self._port}"
        self.kind = "serial" if self._pty else transport
        self._threads = [threading.Thread(target=self._serve, daemon=True)]
        self._threads[0].start()

    def lose(self, kind: str) -> None:
        """Lose it."""
        self.loss = kind
        if kind == "unplugged":
            self.unplug()
        if kind == "stalled" and self._pty:
            import termios

            termios.tcflow(self._theirs, termios.TCOOFF)

    def mend(self) -> None:
        """Bring it back; it has forgotten the half of a request that reached it."""
        with self.lock:
            vars(self.stub)["_waiting"] = b""
        was, self.loss = self.loss, ""
        if was == "unplugged":
            self.plug_in()
        if was == "stalled" and self._pty:
            import termios

            termios.tcflow(self._theirs, termios.TCOON)

    def plug_in(self) -> None:
        """Make the port or the listener."""
        if self._pty:
            import tty

            ours, self._theirs = os.openpty()
            tty.setraw(self._theirs)
            self._link.unlink(missing_ok=True)
            self._link.symlink_to(os.ttyname(self._theirs))
            self._ours = ours
        else:
            self._listener = socket.create_server(("127.0.0.1", self._port))
            self._port = self._listener.getsockname()[1]

    def unplug(self) -> None:
        """Take the port or the listener away."""
        if self._pty:
            self._link.unlink(missing_ok=True)
            ours, self._ours = self._ours, -1
            os.close(ours)  # theirs stays open: a client that looks for it must find no other's
        elif self._listener is not None:
            self._listener.close()
            self._listener = None

    def close(self) -> None:
        """End all threads."""
        self._stop.set()
        with suppress(OSError):
            self.unplug()
        for thread in self._threads:
            thread.join(5)

    def _serve(self) -> None:
        while not self._stop.is_set():
            if self._pty:
                if (ours := self._ours) >= 0:
                    self._converse(_Pty(ours))
                time.sleep(POLL_S)
                continue
            listener = self._listener
            if listener is None:
                time.sleep(POLL_S)
                continue
            with suppress(OSError):
                listener.settimeout(0.05)
                link, _ = listener.accept()
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                thread = threading.Thread(target=self._converse, args=(link,), daemon=True)
                thread.start()
                self._threads.append(thread)

    def _converse(self, link: socket.socket | _Pty) -> None:
        with suppress(OSError), link:
            while not self._stop.is_set():
                if self.loss == "unplugged":
                    return
                if self.loss == "flood":
                    link.sendall(FLOOD)
                if self.loss == "stalled" and not self._pty:
                    time.sleep(POLL_S)  # what comes is kept by the system, and carried out later
                    continue
                ready, _, _ = select.select([link], [], [], POLL_S)
                if not ready:
                    continue
                data = link.recv(4096)
                if not data:
                    return
                if self.loss == "silence":
                    continue
                for answer in self._answers(data):
                    if self.loss == "slow":
                        threading.Timer(SLOW_S, _send_late, (link, answer)).start()
                    else:
                        link.sendall(answer)

    def _answers(self, data: bytes) -> list[bytes]:
        """Carry out what came, and return what goes out."""
        if self._mbap:  # several requests may have come at once
            frames = []
            while len(data) >= 6:
                end = 6 + int.from_bytes(data[4:6], "big")
                frames.append((data[:4], data[6:end] + crc(data[6:end])))
                data = data[end:]
            return [one for head, frame in frames for one in self._answered(head, frame)]
        return self._answered(b"", data)

    def _answered(self, head: bytes, data: bytes) -> list[bytes]:
        loss = self.loss
        if loss == "exception":
            return [_framed(head, one) for one in self._exceptions(data)]
        with self.lock:
            answers = (self.stranger if loss == "foreign" else self.stub).receive(data)
        if loss == "damaged" and head:  # no checksum follows: the header is what can be damaged
            head = head[:2] + b"\x55\x55"
        elif loss == "damaged":
            answers = [_damaged(one, text=self.family != "riden") for one in answers]
        if loss == "echo" and not head:
            answers = [data, *answers]
        return [_framed(head, one) for one in answers]

    def _exceptions(self, data: bytes) -> list[bytes]:
        if self.family == "riden":
            body = bytes([data[0], data[1] | 0x80, 4])
            return [body + crc(body)]
        return [b"ERR" + b"\n" * (self.family == "scpi")] if b"?" in data else []


class _Pty:
    """A pseudo terminal with the verbs of a socket."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    def fileno(self) -> int:
        return self._handle

    def recv(self, most: int) -> bytes:
        return os.read(self._handle, most)

    def sendall(self, data: bytes) -> None:
        _, ready, _ = select.select([], [self._handle], [], 0.05)
        if ready:  # nobody may be reading
            os.write(self._handle, data)

    def __enter__(self) -> _Pty:
        return self

    def __exit__(self, *error: object) -> None:
        pass


def _send_late(link: socket.socket | _Pty, answer: bytes) -> None:
    with suppress(OSError):
        link.sendall(answer)


def _framed(head: bytes, answer: bytes) -> bytes:
    """Put an RTU answer behind the header of Modbus TCP, where there is one."""
    if not head:
        return answer
    body = answer[:-2]
    return head + len(body).to_bytes(2, "big") + body


def _damaged(answer: bytes, *, text: bool) -> bytes:
    at = len(answer) // 2
    return answer[:at] + bytes([answer[at] ^ (0x80 if text else 0x55)]) + answer[at + 1 :]


def _estrange(stub: Foreign) -> None:
    """Make a stub another one of its kind: another serial number."""
    if isinstance(stub, Rd6006):
        stub.words[2] ^= 0x55
    elif isinstance(stub, Ka3005p):
        stub.identity = b"KORADKA3005PV2.0 SN:00000007"
    elif isinstance(stub, Hmp4040):
        stub.identity = stub.identity.replace("100500", "100777")


MAKERS: dict[str, tuple[Callable[[], Foreign], str]] = {
    "riden": (Rd6006, "RD6006"),
    "korad": (Ka3005p, "KA3005P"),
    "scpi": (Hmp4040, "HMP4040"),
}


@contextmanager
def _started(line: LossyLine, model: str, folder: Path, keep_s: float) -> Iterator[Terminal]:
    code = textwrap.dedent(CLIENT)
    words = [line.family, line.kind, line.address, model, str(folder), str(keep_s), VOLTS]
    terminal = Terminal([sys.executable, "-c", code, *words], folder / "state")
    try:
        yield terminal
    finally:
        terminal.end()


class Terminal:
    """A client's process, and all that it and its guardian say, with the times."""

    def __init__(
        self, words: Sequence[str], state: Path, env: Mapping[str, str] | None = None
    ) -> None:
        self.said: list[tuple[float, str]] = []
        self.process = subprocess.Popen(
            words,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=os.environ | {"WORKBENCH_STATE": str(state)} | dict(env or {}),
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append((time.monotonic(), line.rstrip()))

    def wait_for(self, word: str, seconds: float) -> None:
        """Return when it was said."""
        end = time.monotonic() + seconds
        while not any(word in line for _, line in self.said):
            assert time.monotonic() < end, self.said
            assert self.process.poll() is None, self.said
            time.sleep(POLL_S)

    def end(self) -> None:
        """End the client, and wait for the guardian, which holds the terminal."""
        with suppress(ProcessLookupError):
            os.kill(self.process.pid, signal.SIGCONT)
        self.process.terminate()
        self._thread.join(ENDS_S)
        self.process.kill()
        self.process.wait()
        if self.process.stdout is not None and not self._thread.is_alive():
            self.process.stdout.close()


def lose_one(case: Case, folder: Path, away_s: float = LOST_S) -> Lost:
    """Drive a supply, lose it, bring it back, and see what was said and done."""
    family, transport = case.way.split(" ")
    make, model = MAKERS[family]
    folder.mkdir(parents=True, exist_ok=True)
    line = LossyLine(make, family, transport, folder)
    found = Lost(case)
    try:
        with _started(line, model, folder, max(KEEP_TRYING_S, away_s + 10)) as terminal:
            terminal.wait_for("on", ENDS_S)
            time.sleep(DRIVEN_S)
            pids = (os.getpid(), terminal.process.pid, *(e["pid"] for e in _events(folder)[:1]))
            wait = ProcessorWait(*pids)
            lost = time.monotonic()
            line.lose(case.kind)
            if case.client != "alive":
                name = "SIGKILL" if case.client == "killed" else "SIGSTOP"
                os.kill(terminal.process.pid, getattr(signal, name))
            _look(found, line, folder, wait, lost + away_s)
            line.mend()
            back, after = time.monotonic(), ProcessorWait(*pids)
            found.off_s = 0.0 if line.stub.terminals().live == 0 else _off_after(line, back, after)
            _look(found, line, folder, after, back + 2 * BAR_S)
            found.off_waited_s = after.until(back + found.off_s)
        _judge(found, terminal, lost)
        found.report_waited_s = wait.until(lost + found.reported_s)
        found.state = fold(_events(folder)).state
        found.live = line.stub.terminals().live > 0
    finally:
        line.close()
    return found


def _look(found: Lost, line: LossyLine, folder: Path, wait: ProcessorWait, until: float) -> None:
    """Compare record and terminals until an instant."""
    while time.monotonic() < until:
        wait.look()
        known = fold(_events(folder))
        with line.lock:
            live = line.stub.terminals().live
        if known.state == "off" and live > 0:
            found.false_off = known.description
        time.sleep(5 * POLL_S)


def _off_after(line: LossyLine, back: float, wait: ProcessorWait) -> float:
    while time.monotonic() < back + 4 * BAR_S:
        wait.look()
        if line.stub.terminals().live == 0:
            return time.monotonic() - back
        time.sleep(POLL_S)
    return float("inf")


def _judge(found: Lost, terminal: Terminal, lost: float) -> None:
    after = [(when - lost, line) for when, line in terminal.said if when > lost]
    found.output = [f"{when:6.2f} {line}" for when, line in after]
    for when, line in after:
        if "OUTPUT MAY BE ON" in line and "by hand" in line:
            found.reported_s = when
            found.cause = re.sub(r".*OUTPUT MAY BE ON \((.*?)\); switch.*", r"\1", line)
            return


def _events(folder: Path) -> list[dict[str, Any]]:
    try:
        whole, _, _ = (folder / "guardian.jsonl").read_text(encoding="utf-8").rpartition("\n")
    except FileNotFoundError:
        return []
    return [json.loads(line) for line in whole.splitlines()]


def lose_many(cases: Sequence[Case], folder: Path) -> Iterator[Lost]:
    """Lose a supply in each way, several at once."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        places = [folder / str(number) for number in range(len(cases))]
        yield from pool.map(lose_one, cases, places)


def table(found: Sequence[Lost]) -> str:
    """Return what was measured, one line a kind and client."""
    lines = ["kind        client   cases  right  reported [s]   off after the return [s]  false"]
    for kind, client in itertools.product(KINDS, CLIENTS):
        mine = [one for one in found if (one.case.kind, one.case.client) == (kind, client)]
        if mine:
            times = (one.reported_s for one in mine if one.reported_s < 60)
            late = max(times, default=float("nan"))
            off = max(one.off_s for one in mine)
            right, false = sum(one.right for one in mine), sum(bool(one.false_off) for one in mine)
            lines.append(
                f"{kind:11} {client:8} {len(mine):5} {right:6} {late:13.2f} {off:26.2f} {false:6}"
            )
    return "\n".join(lines)
