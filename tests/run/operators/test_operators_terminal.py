"""Lines typed at a terminal that another place may answer first."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from queue import Queue

import pytest

from workbench.cli.terminal import print_text
from workbench.errors import InputError
from workbench.run import ControlServer, answer, session_files, watch
from workbench.run.control import open_control_server
from workbench.run.operators import Keyboard, TerminalOperator

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")


class Terminal:
    """A pseudo terminal and what types at it."""

    def __init__(self) -> None:
        self.typing, self.descriptor = os.openpty()

    def type(self, text: str) -> None:
        os.write(self.typing, text.encode())

    def close(self) -> None:
        for end in (self.typing, self.descriptor):
            os.close(end)


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    opened.type("\n\x04")  # lets its reader end
    time.sleep(0.1)
    opened.close()


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[ControlServer]:
    with open_control_server(tmp_path / "runs", "e", {}) as opened:
        yield opened


def soon(what: object, *arguments: object) -> None:
    """Do something in a moment, while the main thread waits."""
    timer = threading.Timer(0.2, what, arguments)  # type: ignore[arg-type]
    timer.start()


def test_a_line_answers_at_the_terminal(terminal: Terminal, desk: ControlServer) -> None:
    operator = TerminalOperator(desk, Keyboard(terminal.descriptor), print_text)
    assert operator.present
    soon(terminal.type, "12 cm\n")
    assert operator.ask("How far?", "") == "12 cm"
    assert operator.answered_at == "terminal"
    soon(terminal.type, "\n")
    assert operator.ask("How far?", "1 m") == "1 m"
    soon(terminal.type, "\n")
    operator.confirm("Ready?")


def test_what_the_panel_answered_is_not_waited_for_at_the_terminal(
    tmp_path: Path, terminal: Terminal, desk: ControlServer, capsys: pytest.CaptureFixture[str]
) -> None:
    operator = TerminalOperator(desk, Keyboard(terminal.descriptor), print_text)
    (card,) = session_files(tmp_path / "runs")
    soon(answer, card, 1, "12 cm")
    assert operator.ask("How far?", "") == "12 cm"
    assert operator.answered_at == "panel"
    assert "12 cm (panel)" in capsys.readouterr().err


def test_a_line_begun_for_one_prompt_never_confirms_the_next(
    tmp_path: Path, terminal: Terminal, desk: ControlServer
) -> None:
    operator = TerminalOperator(desk, Keyboard(terminal.descriptor), print_text)
    (card,) = session_files(tmp_path / "runs")
    soon(answer, card, 1, "")
    operator.confirm("First?")
    terminal.type("\n")  # an instant too late: it was answered in the panel
    time.sleep(0.2)
    soon(answer, card, 2, "by the panel")
    assert operator.ask("Does the motor turn?", "") == "by the panel"


def test_what_was_typed_before_a_prompt_does_not_answer_it(terminal: Terminal) -> None:
    keyboard, lines = Keyboard(terminal.descriptor), Queue[str]()
    terminal.type("too early\n")
    time.sleep(0.1)
    with keyboard.lines_to(lines.put):
        terminal.type("in time\n")
        assert lines.get(timeout=3) == "in time"
    assert lines.empty()


def test_with_nobody_there_a_prompt_that_is_needed_is_refused(
    desk: ControlServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.run.operators.terminal._RELOAD_S", 0.2)
    with Path(os.devnull).open() as nothing:
        keyboard = Keyboard(nothing.fileno())
        assert not keyboard.present
        with pytest.raises(InputError, match=r"nobody to ask at this terminal: 'Ready\?'"):
            TerminalOperator(desk, keyboard, print_text).confirm("Ready?")
        passed = TerminalOperator(desk, keyboard, print_text, needed=False)
        assert passed.ask("How far?", "1 m") == "1 m"
        assert passed.answered_at == "nobody"


def test_a_page_that_is_open_is_somebody_to_ask(tmp_path: Path, desk: ControlServer) -> None:
    (card,) = session_files(tmp_path / "runs")
    with Path(os.devnull).open() as nothing, watch(card) as line:
        line.send({"pages": 1})
        operator = TerminalOperator(desk, Keyboard(nothing.fileno()), print_text)
        assert operator.present
        soon(answer, card, 1, "")
        operator.confirm("Ready?")
        assert operator.answered_at == "panel"


def test_a_terminal_that_was_closed_is_nobody(
    terminal: Terminal, desk: ControlServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.run.operators.terminal._RELOAD_S", 0.2)
    operator = TerminalOperator(desk, Keyboard(terminal.descriptor), print_text)
    soon(terminal.type, "\x04")  # Ctrl-D
    with pytest.raises(InputError, match="nobody to ask"):
        operator.confirm("Ready?")
    assert not operator.present
