"""A real terminal of 80 columns: a command writes to it in this process, and its screen is read."""

from __future__ import annotations

import fcntl
import os
import signal
import struct
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pyte
import pytest

from workbench.cli import main

__all__ = ["Screen", "shown_on_a_terminal"]

_ROWS = 200  # so that nothing scrolls away


@dataclass(frozen=True)
class Screen:
    """What stands on a terminal at the end, line by line, and how the command ended."""

    lines: tuple[str, ...]
    code: int

    @property
    def text(self) -> str:
        return "\n".join(self.lines)


def shown_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, *words: object, columns: int = 80
) -> Screen:
    """Run the command line on a pseudo terminal.

    The line of progress appears at once, as if each stage had lasted: tests are not slow enough.
    """
    monkeypatch.setattr("workbench.cli.progress._QUIET_S", 0.0)
    monkeypatch.setenv("TERM", "xterm-256color")
    for name in ("COLUMNS", "LINES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "argv", ["workbench", *map(str, words)])
    code, before = 0, signal.getsignal(signal.SIGINT)
    with _terminal(monkeypatch, columns) as screen:
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            signal.signal(signal.SIGINT, before)
    lines = [line.rstrip() for line in screen.display]
    while lines and not lines[-1]:
        lines.pop()
    return Screen(tuple(lines), code)


@contextmanager
def _terminal(monkeypatch: pytest.MonkeyPatch, columns: int) -> Iterator[pyte.Screen]:
    """Put a pseudo terminal in the place of standard output and error."""
    import pty

    screen = pyte.Screen(columns, _ROWS)
    stream = pyte.ByteStream(screen)
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", _ROWS, columns, 0, 0))
    reader = threading.Thread(target=_read, args=(ours, stream), daemon=True)
    reader.start()
    with monkeypatch.context() as patch, os.fdopen(theirs, "w", encoding="utf-8") as end:
        end.reconfigure(line_buffering=True)
        for name in ("stdout", "stderr", "__stdout__", "__stderr__", "__stdin__"):
            patch.setattr(sys, name, end)
        yield screen
    reader.join(10)
    os.close(ours)


def _read(ours: int, stream: pyte.ByteStream) -> None:
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # the other end is closed
            return
        if not piece:
            return
        stream.feed(piece)
