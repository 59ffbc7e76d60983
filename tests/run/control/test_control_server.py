"""A run's desk: seen, answered and stopped by others, and never held up by them."""

from __future__ import annotations

import json
import os
import signal
import socket
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from workbench.errors import ControllerGone, InputError, RecordError
from workbench.loopback import HERE, Message, MessageLine
from workbench.run import (
    ControlServer,
    SessionFile,
    answer,
    holder,
    press_stop,
    session_files,
    watch,
)
from workbench.run.control import claim, open_control_server

pytestmark = pytest.mark.xdist_group("alone")  # answers are timed
posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX files and signals")
HOLDS = """
import sys, time
from pathlib import Path
from workbench.run.control.session import claim
with claim(Path(sys.argv[1]), "e", {}):
    print("holds", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    return tmp_path / "runs"


@pytest.fixture
def desk(runs: Path) -> Iterator[ControlServer]:
    with open_control_server(runs, "e", {"title": "T"}) as opened:
        yield opened


@pytest.fixture
def card(runs: Path, desk: ControlServer) -> SessionFile:
    (found,) = session_files(runs)
    return found


def heard(line: MessageLine, seconds: float = 3.0) -> Message:
    found = line.receive(seconds)
    assert found is not None
    return found


def shown(line: MessageLine, **wanted: object) -> Message:
    """Wait until the server publishes something."""
    deadline = time.monotonic() + 3
    while time.monotonic() < deadline:
        found = heard(line)
        if all(found[name] == value for name, value in wanted.items()):
            return found
    raise AssertionError(f"never shown: {wanted}")


@posix
def test_a_card_is_for_its_owner_s_eyes_and_gone_at_the_end(runs: Path) -> None:
    with open_control_server(runs, "e", {"title": "T"}) as desk:
        (card,) = session_files(runs)
        assert card.pid == os.getpid()
        assert card.facts["token"] == desk.token
        assert stat.S_IMODE(card.path.stat().st_mode) == 0o600
        assert stat.S_IMODE(card.path.parent.stat().st_mode) == 0o700
        assert not runs.exists()  # the folder of runs holds runs alone
    assert session_files(runs) == []


def test_one_experiment_is_carried_out_once_at_a_time(runs: Path) -> None:
    words = f"e: process {os.getpid()} carries it out; see .*json"
    with claim(runs, "e", {}):
        with pytest.raises(InputError, match=words), claim(runs, "e", {}):
            pass
        with claim(runs, "another", {}):
            assert len(session_files(runs)) == 2
    assert holder(runs, "e") is None
    with claim(runs, "e", {}):
        pass


@posix
def test_the_card_of_a_process_that_was_killed_holds_nothing_up(runs: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(runs)], stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        other.stdout.readline()
        held = holder(runs, "e")
        assert held is not None
        assert held.pid == other.pid
        other.kill()
    assert holder(runs, "e") is None
    assert [card.pid for card in session_files(runs)] == [
        other.pid
    ]  # it is told of until somebody begins
    with claim(runs, "another", {}):
        assert [card.experiment for card in session_files(runs)] == ["another"]


@posix
def test_a_card_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "runs.live").write_text("in the way")
    words = r"e\.json: cannot be written and locked \(.*\); choose another folder with --runs"
    with pytest.raises(RecordError, match=words), claim(tmp_path / "runs", "e", {}):
        pass


def test_a_visitor_sees_phase_question_notice_and_end(runs: Path) -> None:
    with open_control_server(runs, "e", {}) as desk, watch(session_files(runs)[0]) as line:
        desk.show_phase("rest 2 s")
        assert shown(line, phase="rest 2 s")["since"] < 1
        with desk.ask("How warm?", typed=True, default="20 degC"):
            told = {"number": 1, "text": "How warm?", "typed": True, "default": "20 degC"}
            told |= {"picture": None, "choices": []}
            shown(line, question=told)
        desk.show_notice("not taken: 99")
        shown(line, question=None, notice="not taken: 99")
        desk.show_phase("drive")
        shown(line, phase="drive", notice="")
        threading.Timer(0.05, desk.close, ("SafetyStop", "too hot")).start()
        shown(line, ended={"kind": "SafetyStop", "text": "too hot"})


def test_a_desk_says_how_its_run_ended(runs: Path) -> None:
    ended: list[object] = []

    def look(card: SessionFile) -> None:
        with watch(card) as line:
            while (found := heard(line))["ended"] is None:
                seen.set()
            ended.append(found["ended"])

    def fail() -> None:
        with open_control_server(runs, "e", {}):
            visitors.append(threading.Thread(target=look, args=session_files(runs)))
            visitors[0].start()
            assert seen.wait(3)
            raise InputError("no such thing")

    seen, visitors = threading.Event(), list[threading.Thread]()
    with pytest.raises(InputError, match="no such thing"):
        fail()
    visitors[0].join()
    assert ended == [{"kind": "InputError", "text": "no such thing"}]


def test_the_first_answer_counts(desk: ControlServer, card: SessionFile) -> None:
    with desk.ask("Ready?", typed=False) as question:
        assert question.wait(0.0) is None
        assert not answer(card, question.number + 1, "")  # of another prompt
        assert answer(card, question.number, " yes ")
        assert not answer(card, question.number, "no")
        assert question.wait(1.0) == ("yes", "panel")
    assert not answer(card, question.number, "late")
    with desk.ask("How far?", typed=True, default="1 m") as question:
        answer(card, question.number, "")
        assert question.wait(1.0) == ("1 m", "panel")


def test_stop_is_a_ctrl_c_wherever_the_main_thread_waits(
    desk: ControlServer, card: SessionFile
) -> None:
    threading.Timer(0.1, press_stop, (card,)).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        time.sleep(10)
    assert time.monotonic() - began < 1
    threading.Timer(0.1, press_stop, (card,)).start()
    with desk.ask("Ready?", typed=False) as question, pytest.raises(KeyboardInterrupt):
        question.wait(10)


@posix
def test_stop_is_heard_where_a_shell_had_ctrl_c_ignored(runs: Path) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as for a command that ends in &
    try:
        with open_control_server(runs, "e", {}):
            threading.Timer(0.1, press_stop, session_files(runs)).start()
            with pytest.raises(KeyboardInterrupt):
                time.sleep(10)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_nobody_is_served_without_the_token(desk: ControlServer, card: SessionFile) -> None:
    stranger = SessionFile(card.path, {**card.facts, "token": "guessed"})
    with pytest.raises(ControllerGone, match="is gone"):
        press_stop(stranger)
    with pytest.raises(ControllerGone, match="is gone"):
        answer(stranger, 1, "")
    time.sleep(0.1)  # a Ctrl-C would come here


def deaf_visitor(desk: ControlServer) -> MessageLine:
    """Watch without ever reading, through buffers that are soon full."""
    link = socket.socket()
    link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    link.connect((HERE, desk.port))
    line = MessageLine(link)
    line.send({"token": desk.token, "want": "watch"})
    return line


def test_a_visitor_that_never_reads_does_not_hold_up_the_run(
    desk: ControlServer, card: SessionFile
) -> None:
    deaf = [deaf_visitor(desk) for _ in range(3)]
    took: list[float] = []

    def work() -> None:
        for number in range(100):
            began = time.perf_counter()
            desk.show_phase("x" * 200_000 + f" {number}")
            took.append(time.perf_counter() - began)
            time.sleep(0.005)  # lets the server send

    worker = threading.Thread(target=work)
    worker.start()
    worker.join(20)
    stuck = worker.is_alive()
    if not stuck:
        with watch(card) as line:  # somebody who reads is served all the same
            assert heard(line)["phase"].endswith(" 99")
        threading.Timer(0.05, press_stop, (card,)).start()
        with pytest.raises(KeyboardInterrupt):
            time.sleep(10)
    for line in deaf:
        line.close()
    worker.join()
    assert not stuck
    assert max(took) < 0.5, f"{max(took)} s"


def test_a_page_that_is_open_counts_as_somebody(desk: ControlServer, card: SessionFile) -> None:
    assert not desk.attended  # after the time in which a panel finds it
    with watch(card) as line:
        for pages in (1, 0):
            line.send({"pages": pages})
            deadline = time.monotonic() + 5
            while desk.attended != bool(pages):
                assert time.monotonic() < deadline
                heard(line)


def test_a_process_that_hangs_is_told_from_one_that_is_dead(runs: Path) -> None:
    with socket.create_server((HERE, 0)) as deaf:
        path = runs / "e.json"
        facts = {"pid": 7, "port": deaf.getsockname()[1], "token": "x"}
        with pytest.raises(ControllerGone, match=r"process 7 hangs: no answer within 0\.5 s"):
            press_stop(SessionFile(path, facts))
    with pytest.raises(ControllerGone, match="process 7 is gone"):
        press_stop(SessionFile(path, facts))


def test_a_card_that_is_half_written_is_none(runs: Path) -> None:
    with claim(runs, "e", {}) as card:
        card.path.write_text(json.dumps(dict(card.facts))[:9])
        assert session_files(runs) == []
