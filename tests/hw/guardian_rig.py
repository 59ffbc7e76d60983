"""A simulated supply in a process of its own, which tells by its own clock what it did."""

from __future__ import annotations

import itertools
import json
import multiprocessing
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection as Pipe
from pathlib import Path
from typing import Any

from workbench.hw import Connection, SystemClock
from workbench.hw.simulated import Fault, SimulatedRiden, serve

OUTPUT = 18  # register of the output's flag
QUICK_S = 0.2  # a fault costs a test so long

History = list[tuple[float, float]]


class Device:
    """The test's hold on the process.

    Args:
        pipe: to it.
        address: where it listens.
    """

    def __init__(self, pipe: Pipe, address: str) -> None:
        self._pipe, self.address = pipe, address
        self.connection = Connection("rtu-over-tcp", address, timeout_s=QUICK_S)

    def _ask(self, what: str, *arguments: object) -> Any:
        self._pipe.send((what, arguments))
        return self._pipe.recv()

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

    def fail(self, fault: Fault) -> None:
        """Switch a fault on."""
        self._ask("fail", fault)

    def mend(self) -> None:
        """Switch the fault off."""
        self._ask("mend")


@contextmanager
def device_process(serial: int = 12345678) -> Iterator[Device]:
    """Serve a simulated RD6006 in another process."""
    spawn = multiprocessing.get_context("spawn")
    here, there = spawn.Pipe()
    process = spawn.Process(target=_serve, args=(there, serial), daemon=True)
    process.start()
    try:
        yield Device(here, here.recv())
        here.send(("stop", ()))
        process.join(10)
    finally:
        process.kill()
        process.join()
        process.close()
        here.close()
        there.close()


def _serve(pipe: Pipe, serial: int) -> None:
    device = SimulatedRiden(clock=SystemClock(), serial=serial, load=lambda volts: 0.05 * volts)
    answers: dict[str, Callable[..., object]] = {
        "history": lambda: device.history,
        "read": device.read,
        "write": device.write,
        "fail": device.fail,
        "mend": device.mend,
    }
    with serve(device) as address:
        pipe.send(address)
        while (request := pipe.recv())[0] != "stop":
            pipe.send(answers[request[0]](*request[1]))


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
