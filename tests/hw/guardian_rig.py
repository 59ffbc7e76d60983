"""A simulated supply in a process of its own, which tells by its own clock what it did."""

from __future__ import annotations

import itertools
import json
import multiprocessing
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing.connection import Connection as Pipe
from pathlib import Path
from typing import Any

from workbench.hw import Connection, Records, SimulatedFault, SystemClock, serve
from workbench.hw.simulated import SimulatedRiden
from workbench.output import ledgers

OUTPUT = 18  # register of the output's flag
QUICK_S = 0.2  # a fault costs a test so long

History = list[tuple[float, float]]


class ProcessorWait:
    """How long processes wait for a processor, by the kernel: that late a promise in time may be.

    Of an idle computer it is 0, as of one whose kernel does not say (Linux does, by thread): there
    a test that adds it to what is promised is no less strict. A process that ends takes its numbers
    along, so they are looked at often. Of a process the thread that waited longest counts.

    Args:
        pids: of the processes that have to do what is promised.
    """

    def __init__(self, *pids: int | None) -> None:
        self._files = [f"/proc/{pid}/task" for pid in pids]
        self._longest_s = dict.fromkeys(self._files, 0.0)
        self._looks: list[tuple[float, float]] = []
        self._before = {folder: self._read(folder) for folder in self._files}

    def _read(self, folder: str) -> dict[Path, int]:
        found: dict[Path, int] = {}
        with suppress(OSError):  # the process has ended
            for file in Path(folder).glob("*/schedstat"):
                with suppress(OSError, IndexError):  # the thread has ended
                    found[file] = int(file.read_text().split()[1])
        return found

    def look(self) -> float:
        """Return for how long they have waited since the begin [s]."""
        for folder, before in self._before.items():
            for file, waited in self._read(folder).items():
                seconds = (waited - before.get(file, 0)) * 1e-9
                self._longest_s[folder] = max(self._longest_s[folder], seconds)
        total = sum(self._longest_s.values())
        self._looks.append((time.monotonic(), total))
        return total

    def look_until(self, instant: float) -> None:
        """Look until an instant of `time.monotonic`."""
        while time.monotonic() < instant:
            self.look()
            time.sleep(0.03)

    def until(self, instant: float) -> float:
        """Return for how long they had waited by an instant [s]."""
        return next((waited for at, waited in self._looks if at >= instant), self.look())


class DeviceProcess:
    """The test's hold on the process; several threads may use it.

    Args:
        pipe: to it.
        pid: its process id.
    """

    def __init__(self, pipe: Pipe, pid: int | None) -> None:
        self._pipe, self.pid = pipe, pid
        self._lock = threading.Lock()

    def new(self, serial: int = 12345678) -> Device:
        """Return one more simulated RD6006, fresh from its box."""
        return Device(self, *self.ask("new", serial))

    def ask(self, what: str, *arguments: object) -> Any:
        """Let it do something and return what came of it."""
        with self._lock:
            self._pipe.send((what, arguments))
            return self._pipe.recv()


class Device:
    """The test's hold on one device.

    Args:
        process: where it is.
        number: among the devices there.
        address: where it listens.
    """

    def __init__(self, process: DeviceProcess, number: int, address: str) -> None:
        self._process, self._number, self.address = process, number, address
        self.pid = process.pid
        self.connection = Connection("rtu-over-tcp", address, timeout_s=QUICK_S)

    def _ask(self, what: str, *arguments: object) -> Any:
        return self._process.ask(what, self._number, *arguments)

    @property
    def history(self) -> History:
        """(time.monotonic() [s], voltage at the terminals [V]) from each change on."""
        return self._ask("history")

    @property
    def volts(self) -> float:
        """What is at the terminals now [V]."""
        return self.history[-1][1]

    def on(self) -> bool:
        """Whether the output's own flag says on."""
        return self.read(OUTPUT, 1) == [1]

    def read(self, register: int, count: int) -> list[int]:
        """Look at its registers."""
        return self._ask("read", register, count)

    def write(self, register: int, word: int) -> None:
        """Turn a knob at its front."""
        self._ask("write", register, [word])

    def fail(self, fault: SimulatedFault) -> None:
        """Switch a fault on."""
        self._ask("fail", fault)

    def mend(self) -> None:
        """Switch the fault off."""
        self._ask("mend")


@contextmanager
def device_process() -> Iterator[DeviceProcess]:
    """Start another process for simulated supplies."""
    spawn = multiprocessing.get_context("spawn")
    here, there = spawn.Pipe()
    process = spawn.Process(target=_serve, args=(there,), daemon=True)
    process.start()
    try:
        yield DeviceProcess(here, process.pid)
        here.send(("stop", ()))
        process.join(10)
    finally:
        process.kill()
        process.join()
        process.close()
        here.close()
        there.close()


def _serve(pipe: Pipe) -> None:
    devices: list[SimulatedRiden] = []
    answers: dict[str, Callable[..., object]] = {
        "history": lambda number: devices[number].history,
        "read": lambda number, *words: devices[number].read(*words),
        "write": lambda number, *words: devices[number].write(*words),
        "fail": lambda number, fault: devices[number].fail(fault),
        "mend": lambda number: devices[number].mend(),
    }
    with ExitStack() as served:
        while (request := pipe.recv())[0] != "stop":
            what, arguments = request
            if what == "new":
                clock = SystemClock()
                device = SimulatedRiden(clock=clock, serial=arguments[0], load=draw)
                devices.append(device)
                pipe.send((len(devices) - 1, served.enter_context(serve(device))))
            else:
                pipe.send(answers[what](*arguments))


def draw(volts: float) -> float:
    """Return the current of a motor [A]."""
    return 0.05 * volts


def off_after(history: History, instant: float) -> float:
    """Return how long after an instant the terminals were live for the last time [s]; 0 if not."""
    ends = [end for (_, volts), (end, _) in itertools.pairwise(history) if volts > 0]
    return max((end - instant for end in ends if end > instant), default=0.0)


def events(path: Path) -> list[dict[str, Any]]:
    """Return what a guardian wrote."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def wait_for(what: Callable[[], object], seconds: float = 10.0) -> None:
    """Return when it is true."""
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "it never came"
        time.sleep(0.01)


def told(records: Records, event: str) -> list[dict[str, Any]]:
    """Return what a guardian wrote about one kind of event."""
    assert records.events is not None
    return [line for line in events(records.events) if line["event"] == event]


def standing() -> str:
    """Return what the only supply of this test is latched for, or nothing."""
    found = [stop for ledger in ledgers() if (stop := ledger.latch())]
    return found[0].reason if found else ""
