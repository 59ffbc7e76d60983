"""Whether a supply answers: reported by the link, watched by whoever cannot wait for its answer."""

from __future__ import annotations

import threading
import time

from workbench.errors import HardwareError

__all__ = ["Health", "NoAnswer"]


class NoAnswer(HardwareError):
    """Nothing at all came back: to ask more would only cost time."""


class Health:
    """How the exchanges with one supply go; safe to share between threads.

    A link reports when it begins to ask, what goes wrong, and when a good answer came. A guardian's
    listener looks while its worker is still waiting. Times are by `time.monotonic`.

    Attributes:
        hurry: a link gives up after the exchange under way and asks nothing again: the supply is
            to be switched off.
    """

    hurry = False

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._since: float | None = None
        self._good_at = time.monotonic()
        self._cause = ""

    def begin(self) -> None:
        """Note that something is asked; an earlier question without an answer counts on."""
        with self._lock:
            if self._since is None:
                self._since = time.monotonic()

    def good(self) -> None:
        """Note a good answer: what was wrong before is over."""
        with self._lock:
            self._since, self._cause, self._good_at = None, "", time.monotonic()

    def fault(self, text: str) -> None:
        """Note what went wrong; the first fault since the last good answer is the cause."""
        with self._lock:
            self._cause = self._cause or text

    @property
    def cause(self) -> str:
        """What went wrong first since the last good answer; empty when nothing did."""
        with self._lock:
            return self._cause

    def answered_since(self, instant: float) -> bool:
        """Return whether a good answer came after an instant of `time.monotonic`."""
        with self._lock:
            return self._good_at > instant

    def overdue(self, seconds: float) -> str:
        """Return why there was no good answer for so long [s]; empty when there was one."""
        with self._lock:
            if self._since is None or time.monotonic() - self._since < seconds:
                return ""
            return self._cause or f"no answer for {seconds:g} s, or the port takes no bytes"
