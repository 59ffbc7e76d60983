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
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection as Pipe
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bundles import guardian_of, journal_of
from tests.hw.guardian_rig import Device, ProcessorWait, device_process, off_after, wait_for
from workbench.bundle import Bundle, Event, Record
from workbench.output import MAY_BE_ON, Latch, Ledger, OutputState, fold, ledgers

ROOT = Path(__file__).resolve().parents[1]
SIGNALS = ("SIGKILL", "SIGSTOP", "SIGTERM", "SIGHUP")
BAR_S = 1.0
WATCHED_S = 1.6  # after the kill; the output must not come on again either
SPAN_S = 3.6  # from the first line of the journal to the end of the drive, about
ON_S = 1.0  # to where the drive begins, about
BOTH_SPAN_S = 6.0  # to the end of the drive of a supply whose scale is checked first, about
ENDS_S = 30.0
AT_ONCE = 4
_ENVIRONMENT = threading.Lock()
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
        waited_s: for how long guardian, supply and client waited for a processor until then.
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
    waited_s: float
    journalled: int
    lost: int
    code: int | None
    bundle: Bundle


def lab_file(folder: Path, device: Device) -> Path:
    """Write a bench whose supply is a device on loopback, and return its path."""
    text, _, _ = (
        (ROOT / "workbench" / "run" / "bench-virtual.yaml").read_text().partition("virtual:\n")
    )
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
        forkserver.set_forkserver_preload(["workbench.cli.terminal", "tests.killing"])
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

    def standing(self) -> Latch | None:
        """Return what its supply is latched for."""
        found = [ledger.latch() for ledger in self.ledgers()]
        return found[0] if found else None

    def known(self) -> OutputState:
        """Return what its supply's ledger knows of the output."""
        return fold(event for ledger in self.ledgers() for event in ledger.events())

    def ledgers(self) -> list[Ledger]:
        """Return its ledgers: where they are is asked once, of the environment that all share."""
        with _ENVIRONMENT, pytest.MonkeyPatch.context() as patch:
            patch.setenv("WORKBENCH_STATE", str(self.state))
            return ledgers()

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
    from workbench.run import QuietOperator

    os.environ["WORKBENCH_STATE"] = str(state)
    sys.stderr = sys.stdout = err.open("w")
    os.dup2(sys.stderr.fileno(), 2)
    if not attended:
        terminal = import_module("workbench.cli.terminal")
        vars(terminal)["operator_at_terminal"] = lambda bench, desk: QuietOperator()
    keep = Record.journal

    def journal(self: Record, event: Event, time_s: float) -> None:
        keep(self, event, time_s)
        pipe.send((event.event, round(time_s, 6)))

    vars_of_record: Any = Record
    vars_of_record.journal = journal
    sys.argv = ["workbench", *words]
    main()


def kill_one(name: str, instant_s: float, folder: Path, device: Device) -> Killed:
    """Start a client, send it a signal at an instant [s], and see what became of the output."""
    client = Client(folder, device)
    lines = client.heard_until("asked")
    until = time.monotonic() + instant_s
    if instant_s > ON_S:  # however busy the computer is, its output is on then
        lines += client.heard_until("output_on")
        until = time.monotonic() + instant_s - ON_S
    while (left := until - time.monotonic()) > 0:
        lines += client.hear(left)
    guardian = next((event["pid"] for event in guardian_of(client.bundle)), None)
    wait = ProcessorWait(guardian, client.process.pid, device.pid)
    sent = client.kill(name)
    while found := client.hear(0.0):
        lines += found
    wait.look_until(sent + WATCHED_S)
    history = device.history
    assert history[-1][1] == 0, f"{name} after {instant_s} s: the output is on"
    was_on = next((volts for t, volts in reversed(history) if t <= sent), 0.0) > 0
    if name == "SIGSTOP":
        client.kill("SIGCONT")
        if not was_on:  # it would go on as if nothing had been
            client.kill("SIGTERM")
    code = client.end()
    bundle = client.bundle
    kept = {(line["event"], line["time_s"]) for line in journal_of(bundle)}
    confirmed = [e["time_s"] - sent for e in guardian_of(bundle) if e.get("confirmed")]
    confirmed_s = next((seconds for seconds in confirmed if seconds > 0), None)
    off_s = off_after(history, sent)
    waited_s = wait.until(sent + max(off_s, confirmed_s or 0.0))
    return Killed(
        name,
        instant_s,
        was_on,
        off_s,
        confirmed_s,
        waited_s,
        len(lines),
        sum(line not in kept for line in lines),
        code,
        bundle,
    )


@dataclass(frozen=True)
class BothKilled:
    """What became of a client and its guardian, killed at one instant.

    Args:
        instant_s: after the first line of the client's journal.
        found_on: whether the output had been left on before.
        live: whether it is on now, by the supply itself.
        record: what the run's record says: a state of `workbench.output`.
        ledger: what the supply's ledger says.
        refused: whether the next run would be refused.
        told: whether the next command of any kind tells it.
    """

    instant_s: float
    found_on: bool
    live: bool
    record: str
    ledger: str
    refused: bool
    told: bool

    @property
    def right(self) -> bool:
        """Whether all that is said of the output is so, or says that it is not known."""
        honest = not (self.live and "off" in (self.record, self.ledger))
        as_before = self.record != "untouched" or self.live == self.found_on
        doubt = self.ledger in ("on", "unknown")
        warned = self.refused and self.told
        # a client that lived a moment longer may have had its guardian replaced, which switched off
        # after the next command had told
        return honest and as_before and (warned if doubt else self.refused or not self.told)


def kill_both(instant_s: float, found_on: bool, folder: Path, device: Device) -> BothKilled:
    """Kill client and guardian at an instant [s]; ask record, ledger and the next command."""
    if found_on:
        device.write(8, 300)
        device.write(18, 1)
    client = Client(folder, device)
    client.heard_until("asked")
    until = time.monotonic() + instant_s
    while (left := until - time.monotonic()) > 0:
        client.hear(left)
    guardian = guardian_of(client.bundle)
    for pid in [event["pid"] for event in guardian[:1]] + [client.process.pid]:
        with suppress(ProcessLookupError):
            os.kill(pid or 0, signal.SIGKILL)
    client.end()
    time.sleep(0.1)  # a write that is under way arrives
    # one that was killed while it waited for the disk dies after that, and watches until then
    wait_for(lambda: not any(ledger.held() for ledger in client.ledgers()), ENDS_S)
    code = "from workbench.cli import main; main()"
    words = [sys.executable, "-c", code, "schema", "shape"]
    env = os.environ | {"WORKBENCH_STATE": str(client.state)}
    next_one = subprocess.run(words, env=env, capture_output=True, text=True, check=False)
    standing = client.standing()
    return BothKilled(
        instant_s,
        found_on,
        device.volts > 0,
        client.bundle.record.output.state,
        client.known().state,
        standing is not None,
        MAY_BE_ON in next_one.stderr,
    )


def kill_both_many(count: int, seed: int, folder: Path) -> list[BothKilled]:
    """Kill client and guardian at random instants, one supply in four left on before."""
    rng = random.Random(seed)
    cases = [(rng.uniform(0, BOTH_SPAN_S), rng.random() < 0.25) for _ in range(count)]
    with device_process() as devices, ThreadPoolExecutor(AT_ONCE) as pool:

        def one(number: int) -> BothKilled:
            return kill_both(*cases[number], folder / str(number), devices.new())

        return list(pool.map(one, range(count)))


def both_table(found: Sequence[BothKilled]) -> str:
    """Return what was said beside what was, one line each."""
    lines = ["output is   record says   ledger says   cases  right"]
    for key in sorted({(one.live, one.record, one.ledger) for one in found}):
        mine = [one for one in found if (one.live, one.record, one.ledger) == key]
        live, record, ledger = key
        right = sum(one.right for one in mine)
        lines.append(
            f"{'on' if live else 'off':11} {record:13} {ledger:13} {len(mine):5} {right:6}"
        )
    return "\n".join(lines)


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
    head = f"{'signal':8} kills  on   terminals dead after [ms]     off read back after [ms]"
    three = "median    95 %     max"
    lines = [
        f"{head}     waited for a processor   lost",
        " " * 21 + f"{three}      {three}      {three}",
    ]
    for name in dict.fromkeys(killed.signal for killed in found):
        mine = [killed for killed in found if killed.signal == name]
        on = [killed for killed in mine if killed.was_on]
        dead = _three([killed.off_s for killed in on])
        back = _three([killed.confirmed_s for killed in on if killed.confirmed_s is not None])
        lost = f"{sum(k.lost for k in mine)} of {sum(k.journalled for k in mine)}"
        wait = _three([killed.waited_s for killed in on])
        lines.append(f"{name:8} {len(mine):5} {len(on):4} {dead}    {back}    {wait}   {lost}")
    return "\n".join(lines)


def _three(seconds: Sequence[float]) -> str:
    if not seconds:
        return f"{'-':>8}" * 3
    return "".join(f"{1000 * value:8.0f}" for value in np.quantile(seconds, (0.5, 0.95, 1.0)))
