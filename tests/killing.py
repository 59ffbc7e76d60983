"""Kill real clients of a real guardian, and let the supply tell how long its output stayed on.

The client is `workbench run` on a bench whose supply is simulated in another process, which stamps
each change at its terminals with the host's monotonic clock. Killed at a random instant from the
bundle's first line to the end of the drive; `benchmarks/kills.py` prints the distribution.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection as Pipe
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.hw.guardian_rig import Device, device_process, off_after
from workbench.bundle import Bundle
from workbench.output import Standing, ledgers

ROOT = Path(__file__).resolve().parents[1]
SIGNALS = ("SIGKILL", "SIGSTOP", "SIGTERM", "SIGHUP")
BAR_S = 1.0
WATCHED_S = 1.6  # after the kill; the output must not come on again either
SPAN_S = 3.6  # from the first line of the journal to the end of the drive, about
ENDS_S = 30.0
AT_ONCE = 4
PROTOCOL = """\
schema: workbench/protocol-1
title: Killed
steps:
  - run: {mode: clamped, speed: 17 rad/s, rest: 0.5 s, duration: 3 s}
"""


@dataclass(frozen=True)
class Killed:
    """What became of one client.

    Args:
        signal: it got.
        instant_s: after the first line of its journal.
        was_on: whether the output was on at that instant.
        off_s: how long after it the terminals were live, by the supply itself.
        confirmed_s: when off was read back, by the guardian; None when it never was.
        journalled: lines that the client had written before.
        lost: those of them that are not in the journal.
        code: exit code.
        bundle: it left.
    """

    signal: str
    instant_s: float
    was_on: bool
    off_s: float
    confirmed_s: float | None
    journalled: int
    lost: int
    code: int | None
    bundle: Bundle


def lab_file(folder: Path, device: Device) -> Path:
    """Write a bench whose supply is a device on loopback, and return its path."""
    text, _, _ = (ROOT / "workbench" / "bench-virtual.yaml").read_text().partition("virtual:\n")
    connection = f"{{kind: rtu-over-tcp, address: '{device.address}'}}"
    path = folder / "lab.yaml"
    path.write_text(text.replace("{kind: simulated}", connection))
    return path


class Client:
    """A `workbench run` in a process of its own, forked where everything is imported already."""

    def __init__(
        self, folder: Path, device: Device, protocol: str = PROTOCOL, attended: bool = False
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "p.yaml").write_text(protocol)
        self.runs, self.err = folder / "runs", folder / "err.txt"
        lab = lab_file(folder, device)
        forkserver = multiprocessing.get_context("forkserver")
        forkserver.set_forkserver_preload(["workbench.cli.run", "tests.killing"])
        self._here, there = forkserver.Pipe()
        words = ["run", folder / "p.yaml", "--bench", lab, "--runs", self.runs]
        self.state = folder / "state"
        arguments = ([str(word) for word in words], self.err, there, attended, self.state)
        self.process = forkserver.Process(target=_client, args=arguments)
        self.process.start()
        there.close()

    @property
    def bundle(self) -> Bundle:
        (path,) = self.runs.iterdir()
        return Bundle.open(path)

    def standing(self) -> Standing | None:
        """Return what its supply is latched for."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("WORKBENCH_STATE", str(self.state))
            found = [ledger.standing() for ledger in ledgers()]
        return found[0] if found else None

    def hear(self, seconds: float) -> list[Any]:
        """Return one line that the client says is in its journal, or none in that time."""
        try:
            return [self._here.recv()] if self._here.poll(seconds) else []
        except (EOFError, ConnectionError):
            return []

    def heard_until(self, event: str) -> list[Any]:
        """Wait for an event and return what was journalled up to it."""
        lines: list[Any] = []
        while not lines or lines[-1][0] != event:
            found = self.hear(60)
            assert found, f"no {event}: {self.err.read_text()}"
            lines += found
        return lines

    def kill(self, name: str) -> float:
        """Send a signal and return when."""
        assert self.process.pid is not None
        instant = time.monotonic()
        os.kill(self.process.pid, getattr(signal, name))
        return instant

    def end(self, seconds: float = ENDS_S) -> int | None:
        """Wait for its end and return the exit code; None when it had to be ended by force."""
        self.process.join(seconds)
        code = self.process.exitcode
        self.process.kill()
        self.process.join()
        self.process.close()
        self._here.close()
        return code


def _client(words: list[str], err: Path, pipe: Pipe, attended: bool, state: Path) -> None:
    """Be the command line, with nobody at the terminal, and tell what is journalled.

    Attended, its prompts have to be answered in a panel; otherwise they answer themselves.
    """
    from workbench.cli import main
    from workbench.cli.output import QuietOperator

    os.environ["WORKBENCH_STATE"] = str(state)
    sys.stderr = sys.stdout = err.open("w")
    os.dup2(sys.stderr.fileno(), 2)
    if not attended:
        at_desk = import_module("workbench.cli.attended")
        vars(at_desk)["operator_of"] = lambda bench, desk: QuietOperator()
    keep = Bundle.journal

    def journal(self: Bundle, event: str, time_s: float, **facts: Any) -> None:
        keep(self, event, time_s, **facts)
        pipe.send((event, round(time_s, 6)))

    vars_of_bundle: Any = Bundle
    vars_of_bundle.journal = journal
    sys.argv = ["workbench", *words]
    main()


def kill_one(name: str, instant_s: float, folder: Path, device: Device) -> Killed:
    """Start a client, send it a signal at an instant [s], and see what became of the output."""
    client = Client(folder, device)
    lines = client.heard_until("asked")
    until = time.monotonic() + instant_s
    while (left := until - time.monotonic()) > 0:
        lines += client.hear(left)
    sent = client.kill(name)
    while found := client.hear(0.0):
        lines += found
    time.sleep(max(sent + WATCHED_S - time.monotonic(), 0.0))
    history = device.history
    assert history[-1][1] == 0, f"{name} after {instant_s} s: the output is on"
    was_on = next((volts for t, volts in reversed(history) if t <= sent), 0.0) > 0
    if name == "SIGSTOP":
        client.kill("SIGCONT")
        if not was_on:  # it would go on as if nothing had been
            client.kill("SIGTERM")
    code = client.end()
    bundle = client.bundle
    kept = {(line["event"], line["time_s"]) for line in bundle.read_journal()}
    confirmed = [e["time_s"] - sent for e in bundle.read_guardian() if e.get("confirmed")]
    return Killed(
        name,
        instant_s,
        was_on,
        off_after(history, sent),
        next((seconds for seconds in confirmed if seconds > 0), None),
        len(lines),
        sum(line not in kept for line in lines),
        code,
        bundle,
    )


def random_instants(count: int, seed: int) -> list[float]:
    """Return instants of a client's life [s], before and while its output is on."""
    rng = random.Random(seed)
    return [rng.uniform(0, SPAN_S) for _ in range(count)]


def kill_many(names: Sequence[str], instants: Sequence[float], folder: Path) -> list[Killed]:
    """Kill a client with each signal at its instant [s], several at once."""
    with device_process() as devices, ThreadPoolExecutor(AT_ONCE) as pool:

        def one(number: int) -> Killed:
            place = folder / str(number)
            return kill_one(names[number], instants[number], place, devices.new())

        return list(pool.map(one, range(len(names))))


def table(found: Sequence[Killed]) -> str:
    """Return the distribution of what was measured, one line a signal."""
    head = f"{'signal':8} kills  on   terminals dead after [ms]     off read back after [ms]   lost"
    lines = [head, " " * 21 + "median    95 %     max      median    95 %     max"]
    for name in dict.fromkeys(killed.signal for killed in found):
        mine = [killed for killed in found if killed.signal == name]
        on = [killed for killed in mine if killed.was_on]
        dead = _three([killed.off_s for killed in on])
        back = _three([killed.confirmed_s for killed in on if killed.confirmed_s is not None])
        lost = f"{sum(k.lost for k in mine)} of {sum(k.journalled for k in mine)}"
        lines.append(f"{name:8} {len(mine):5} {len(on):4} {dead}    {back}   {lost}")
    return "\n".join(lines)


def _three(seconds: Sequence[float]) -> str:
    if not seconds:
        return f"{'-':>8}" * 3
    return "".join(f"{1000 * value:8.0f}" for value in np.quantile(seconds, (0.5, 0.95, 1.0)))
