"""The terminal's keyboard, read by a thread: a prompt may be answered elsewhere meanwhile.

Nothing else works on every system: Windows cannot wait for its console and for something else at
once. Only what is typed while a prompt is shown answers it; a line that was begun for a prompt
that has been answered elsewhere must not confirm the next one.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

if sys.platform == "win32":
    import msvcrt
else:
    import termios

__all__ = ["Keyboard"]

_LINE = 65536  # bytes that a terminal gives at once, at most


class Keyboard:
    """Lines from the terminal at a file descriptor.

    Args:
        descriptor: of standard input.
    """

    def __init__(self, descriptor: int = 0) -> None:
        self._descriptor = descriptor
        self._wanted = threading.Event()
        self._take: Callable[[str], object] | None = None
        self._ended = not os.isatty(descriptor)
        self._thread: threading.Thread | None = None

    @property
    def present(self) -> bool:
        """Whether somebody could type: a terminal, ours now, that was not closed with Ctrl-D."""
        return not self._ended and self._in_front()

    @contextmanager
    def lines_to(self, take: Callable[[str], object]) -> Iterator[None]:
        """Give each line that is typed to `take`, in a thread, until the block ends."""
        if not self.present:
            yield
            return
        self._forget()
        self._take = take
        self._wanted.set()
        if self._thread is None:
            self._thread = threading.Thread(target=self._read, name="keyboard", daemon=True)
            self._thread.start()
        try:
            yield
        finally:
            self._take = None
            self._wanted.clear()
            self._forget()

    def _read(self) -> None:
        while not self._ended:
            self._wanted.wait()
            try:
                # not through sys.stdin: at exit the interpreter would wait for its lock
                line = os.read(self._descriptor, _LINE)
            except OSError:
                line = b""
            self._ended = not line
            take = self._take
            if line and take is not None:
                take(
                    line.decode(os.device_encoding(self._descriptor) or "utf-8", "replace").strip()
                )

    def _forget(self) -> None:
        """Drop what was typed and not read yet."""
        if sys.platform == "win32":
            while msvcrt.kbhit():
                msvcrt.getwch()
        elif self._in_front():
            with suppress(termios.error):
                termios.tcflush(self._descriptor, termios.TCIFLUSH)

    def _in_front(self) -> bool:
        """Return whether the terminal is ours; a background program is stopped by reading."""
        if sys.platform == "win32":
            return True
        with suppress(OSError):
            return os.tcgetpgrp(self._descriptor) == os.getpgrp()
        return True  # a terminal that controls nobody
