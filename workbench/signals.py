"""Ctrl-C and its kin while something must not be left half done."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

__all__ = ["Signals"]

_ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # the last two on some systems only


class Signals:
    """What becomes of the signals that end a program, while this context lasts.

    Each raises `KeyboardInterrupt`, as it did before; inside `first_only` the first one alone, so
    that no impatient second one can come between it and what it has to lead to. From `hold` on
    none raises. Outside a main thread, which alone gets signals, nothing is changed, nor is a
    signal that was ignored.
    """

    def __init__(self) -> None:
        self._held: list[signal.Signals] = []
        self._holding = self._first_only = False
        self._previous: dict[signal.Signals, Callable[[int, FrameType | None], Any] | int] = {}

    def __enter__(self) -> Signals:
        """Listen."""
        if threading.current_thread() is threading.main_thread():
            for number in (signal.Signals[name] for name in _ENDING if hasattr(signal, name)):
                previous = signal.getsignal(number)
                if previous not in (None, signal.SIG_IGN):  # None: set by other than Python
                    self._previous[number] = previous
                    signal.signal(number, self._come)
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the signals as they were."""
        for number, previous in self._previous.items():
            signal.signal(number, previous)

    def hold(self) -> None:
        """Hold back every signal from here on."""
        self._holding = True

    @contextmanager
    def first_only(self) -> Iterator[None]:
        """Let one signal raise, and hold back what comes after it.

        Left by an exception, signals stay as they are; left in order, they raise again, and one
        that was held back does so at once.
        """
        self._first_only = True
        yield
        self._holding = self._first_only = False
        if self._held:
            raise KeyboardInterrupt(self._held.pop(0).name)

    def _come(self, number: int, frame: FrameType | None) -> None:
        if self._holding:
            self._held.append(signal.Signals(number))
            return
        self._holding = self._first_only
        previous = self._previous[signal.Signals(number)]
        if callable(previous):
            previous(number, frame)
            self._holding = False  # it did not raise
        else:
            raise KeyboardInterrupt(signal.Signals(number).name)
