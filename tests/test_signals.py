"""Ctrl-C and its kin: one ends a run, and wherever a second one comes, the run tells the truth."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from decimal import Decimal
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

import workbench.run.bench
import workbench.run.engine
import workbench.signals
from tests.bundles import manifest_of
from tests.hw.hw_stub import AtOnce
from workbench.bundle import Bundle, Event, Record, verify
from workbench.cli.app import pending_interruption
from workbench.errors import Interrupted
from workbench.hw import SimulatedSupply
from workbench.run import Experiment, QuietOperator, carry_out, load_bench
from workbench.run.bench import VirtualBench
from workbench.schemas import Protocol, load, load_model, load_shape, make_plan
from workbench.signals import Signals

PROTOCOL = """\
schema: workbench/protocol-1
title: Stopped twice
steps:
  - run: {mode: clamped, speed: 17 rad/s, rest: 0.5 s, duration: 1 s}
"""
# where a signal may come between the first one and the run's end; the rest is called from there
FILES = {workbench.run.engine.__file__, workbench.signals.__file__, contextlib.__file__}
posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")


def ctrl_c() -> None:
    signal.raise_signal(signal.SIGINT)


def press_twice() -> None:
    try:
        ctrl_c()
    finally:
        ctrl_c()


def press_held_back(signals: Signals) -> None:
    signals.hold()
    ctrl_c()


@pytest.fixture
def asked(tmp_path: Path) -> Experiment:
    path = tmp_path / "p.yaml"
    path.write_text(PROTOCOL)
    protocol, bench = load(path, Protocol), load_bench("virtual")
    plan = make_plan(protocol, bench.content, Decimal("0.01"))
    model, shape = load_model("thesis", tmp_path), load_shape("thesis-initial", tmp_path)
    return Experiment(protocol, bench, model, shape, plan)


def make_cheap(patch: pytest.MonkeyPatch) -> None:
    """Leave out what a run costs outside `FILES`: the supply's server, the disk, the versions."""

    @contextlib.contextmanager
    def serve(device: SimulatedSupply, framing: str) -> Iterator[str]:
        patch.setattr("workbench.hw.channel._Socket", lambda connection: AtOnce(device))
        yield "127.0.0.1:1"

    found = workbench.run.engine.versions()
    patch.setattr(workbench.run.engine, "versions", lambda: found)
    patch.setattr(workbench.run.bench, "serve", serve)
    patch.setattr(os, "fsync", lambda file: None)


class SecondCtrlC:
    """Ctrl-C at an event of the journal, and again some lines of the program later.

    Args:
        lines: how many, of those in `FILES`; None counts them all and presses no second time.
    """

    def __init__(self, event: str, lines: int | None = None) -> None:
        self.event, self.lines, self.counted = event, lines, 0
        self.keep = Record.journal

    def journal(self, record: Record, event: Event, time_s: float) -> None:
        self.keep(record, event, time_s)
        if event.event == self.event and not self.counted:
            frame = sys._getframe()
            while frame := frame.f_back:  # those that the first one will unwind
                frame.f_trace = self.trace
            sys.settrace(self.trace)
            ctrl_c()

    def trace(self, frame: FrameType, event: str, _: Any) -> Callable[..., Any] | None:
        if frame.f_code.co_filename not in FILES:
            return None
        if event == "line":
            self.counted += 1
            if self.counted == self.lines:
                sys.settrace(None)
                ctrl_c()
        return self.trace


def stopped(asked: Experiment, folder: Path, twice: SecondCtrlC) -> tuple[str, Bundle]:
    """Begin a run, stop it, and return its message and the bundle."""
    bench = VirtualBench(asked.bench.content)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Record, "journal", lambda *words: twice.journal(*words))
        with pytest.raises((Interrupted, KeyboardInterrupt)) as caught:
            list(carry_out(asked, bench, folder, QuietOperator(), lambda text: None))
        sys.settrace(None)
    end = caught.value
    message = pending_interruption(end) if isinstance(end, KeyboardInterrupt) else end
    assert not bench.device.output.on
    return str(message), Bundle.open(next(folder.iterdir()))


@posix
@pytest.mark.budget(15)  # a run for each line of the program where a second one may come
@pytest.mark.parametrize(
    ("event", "output"),
    [("asked", "nothing was switched"), ("voltage", "the output is off, confirmed")],
)
def test_wherever_a_second_ctrl_c_comes_the_run_ends_as_interrupted(
    asked: Experiment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, event: str, output: str
) -> None:
    real, cheap = SecondCtrlC(event), SecondCtrlC(event)
    stopped(asked, tmp_path / "real", real)
    make_cheap(monkeypatch)
    stopped(asked, tmp_path / "cheap", cheap)
    assert cheap.counted == real.counted > 20
    for line in range(1, real.counted + 1):
        text, bundle = stopped(asked, tmp_path / str(line), SecondCtrlC(event, line))
        assert f"stopped by the user\n{output}" in text, line
        assert manifest_of(bundle)["status"] == "interrupted", line
        assert verify(bundle.path) == [], line


def test_every_signal_raises_unless_held_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    with Signals() as signals:
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                ctrl_c()
        signals.hold()
        ctrl_c()
    assert signal.getsignal(signal.SIGINT) is before


def test_the_first_alone_raises_and_a_later_one_is_held_back() -> None:
    with Signals() as signals:
        with pytest.raises(KeyboardInterrupt), signals.first_only():
            press_twice()
        ctrl_c()  # still held back: what the first one leads to goes on


def test_one_that_was_held_back_raises_at_the_end() -> None:
    with Signals() as signals:
        with pytest.raises(KeyboardInterrupt, match="SIGINT"), signals.first_only():
            press_held_back(signals)
        with pytest.raises(KeyboardInterrupt):
            ctrl_c()


@posix
def test_a_signal_that_would_kill_raises_and_an_ignored_one_stays_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    hung_up = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Signals() as signals:
            with pytest.raises(KeyboardInterrupt, match="SIGTERM"):
                os.kill(os.getpid(), signal.SIGTERM)
            with signals.first_only():
                signals.hold()
                os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGTERM, before)
        signal.signal(signal.SIGHUP, hung_up)


def test_another_thread_changes_nothing() -> None:
    found: list[object] = []

    def enter() -> None:
        with Signals():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert found == [signal.getsignal(signal.SIGINT)]


RECEIVED = """\
import signal, subprocess, sys
import pytest

def test_ctrl_c():
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)

def test_ctrl_c_of_a_child():
    words = "import signal; signal.raise_signal(signal.SIGINT)"
    child = subprocess.run([sys.executable, "-c", words], capture_output=True)
    assert child.returncode == -signal.SIGINT
"""


@posix
def test_the_tests_receive_a_ctrl_c_that_a_shell_had_ignored(root: Path, tmp_path: Path) -> None:
    (tmp_path / "test_received.py").write_text(RECEIVED)
    tests = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "tests.conftest"]
    shell = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]  # as for a command that ends in &
    # from its own folder on: else the folders of all tests beside this one are looked through
    words = [*shell, *tests, "--rootdir", tmp_path, tmp_path / "test_received.py"]
    found = subprocess.run(words, cwd=root, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout
    assert "2 passed" in found.stdout
