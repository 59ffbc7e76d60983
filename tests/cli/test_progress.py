"""Progress: one line that stays on a terminal, plain lines anywhere else, never on stdout."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from tests.conftest import Command
from workbench.cli.progress import ProgressLine
from workbench.progress import Stage, counted, within

MAIN = [sys.executable, "-c", "from workbench.cli import main; main()"]


class Terminal:
    """A terminal whose line is looked at, and whose time is set."""

    def __init__(self, interactive: bool = True) -> None:
        self.now = 100.0
        self.file = io.StringIO()
        console = Console(
            file=self.file,
            force_terminal=interactive,
            force_interactive=interactive,
            width=100,
            highlight=False,
        )
        self._console = Console(width=100)
        self.stages = ProgressLine(console, lambda: self.now)

    def shown(self) -> str:
        with self._console.capture() as seen:
            self._console.print(self.stages.line())
        return " ".join(seen.get().split())


def test_off_a_terminal_every_phase_is_one_plain_line() -> None:
    pipe = Terminal(interactive=False)
    for number in (1, 2):
        pipe.stages(counted("read", number, 2))
        pipe.stages.update(Stage("not told", 0.9))
        pipe.now += 60
    pipe.stages.pause()
    assert pipe.file.getvalue() == "  read (1 of 2)\n  read (2 of 2)\n"


def test_a_line_appears_after_two_seconds_with_the_time_gone_and_what_a_phase_lasts() -> None:
    terminal = Terminal()
    terminal.stages(Stage("drive 10 s: 17 rad/s", seconds=10.0))
    terminal.now += 1.9
    assert terminal.shown() == ""
    terminal.now += 1.1
    assert terminal.shown().startswith("drive 10 s: 17 rad/s ")
    assert terminal.shown().endswith(" 30% 0:03 0:07 left")
    terminal.stages("track, twin")
    terminal.now += 5
    assert terminal.shown() == "track, twin 0:05"
    terminal.stages.pause()
    assert terminal.shown() == ""
    kept = terminal.file.getvalue()
    assert "drive 10 s: 17 rad/s  0:03" in kept  # what is over stays to be read
    assert "track, twin  0:05" in kept


def test_words_that_are_too_long_leave_room_for_the_share() -> None:
    terminal = Terminal()
    terminal.stages(Stage("see what each promises beside " + "a_long_name, " * 9, 0.4))
    terminal.now += 5
    line = terminal.shown()
    assert len(line) <= 100
    assert "\u2026" in line
    assert line.endswith("40% 0:05")


def test_time_left_follows_the_share_that_is_done() -> None:
    terminal = Terminal()
    told = [within(terminal.stages, f"run {k + 1} of 4: ", k / 4) for k in range(4)]
    told[0]("rest")
    terminal.now += 10
    told[1]("rest")  # a quarter took 10 s, so the rest takes 30 s
    terminal.now += 4
    line = terminal.shown()
    assert line.startswith("run 2 of 4: rest ")
    assert line.endswith("25% 0:04 0:26 left")
    told[1]("drive")
    assert terminal.shown().endswith("25% 0:00 0:26 left"), "no part was done since"
    terminal.stages(counted("another piece", 1, 9))
    terminal.now += 3
    assert "left" not in terminal.shown(), "of a piece that only begins nobody knows it"


def test_a_search_that_goes_on_is_not_credited_with_what_was_done_before() -> None:
    terminal = Terminal()
    terminal.stages("search")
    terminal.now += 1
    terminal.stages.update(Stage("half was done", 0.5))
    terminal.now += 5
    terminal.stages.update(Stage("a quarter in 5 s", 0.75))
    assert terminal.stages.left() == pytest.approx(5.0)


def test_quiet_is_silent_about_progress_only(workbench: Command, root: Path) -> None:
    words = ("run", root / "protocols" / "hop-17.yaml", "--dry-run")
    loud, quiet = workbench(*words), workbench(*words, "--quiet")
    assert "rehearse 1 run on a simulated supply" in loud.err
    assert quiet.err == ""
    assert quiet.out == loud.out
    assert workbench("--quiet", *words).err == ""
    failed = workbench("run", "nowhere.yaml", "--quiet")
    assert "nowhere.yaml: no such file" in failed.err


def test_what_follows_two_dashes_is_no_option(workbench: Command) -> None:
    answer = workbench("runs", "verify", "--", "--quiet")
    assert answer.code == 2
    assert "--quiet: no run, folder of runs" in answer.err


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")
@pytest.mark.parametrize(
    ("words", "variables", "coloured"),
    [([], {}, True), (["--no-color"], {}, False), ([], {"TERM": "dumb"}, False)],
    ids=["as it is", "--no-color", "TERM=dumb"],
)
def test_colours_on_a_terminal_until_they_are_refused(
    words: list[str], variables: dict[str, str], coloured: bool
) -> None:
    terminal = {"TERM": "xterm-256color", "COLUMNS": "100"} | variables
    clean = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    seen = _on_a_terminal(["runs", "show", "nothing-here", *words], clean | terminal)
    assert "nothing-here: no run, folder of runs" in " ".join(seen.split())
    assert bool(re.search(r"\x1b\[[0-9;]*3[0-9]m", seen)) == coloured


def _on_a_terminal(words: list[str], variables: dict[str, str]) -> str:
    """Return everything that a command writes to a terminal of its own."""
    import pty

    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [*MAIN, *words], stdin=theirs, stdout=theirs, stderr=theirs, env=variables
    )
    os.close(theirs)
    seen = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        seen += piece
    os.close(ours)
    process.wait(timeout=60)
    return seen.decode(errors="replace")
