"""Which process carries out a run, and if it is alive: by its control server, not its number."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from workbench.errors import ControllerGone
from workbench.loopback import MessageLine
from workbench.run import SessionFile, holder, session_files, watch

__all__ = ["Controller", "ControllerWatch", "State"]

State = Literal["idle", "alive", "silent", "gone", "ended"]

LOOK_S = 0.2
"""How often a new run is looked for [s]."""
ANSWER_S = 0.8
"""A control server that sends nothing for so long belongs to a process that hangs [s]."""


@dataclass(frozen=True)
class Controller:
    """The process that carries out a run, as it is known here.

    Args:
        state: `idle` before the first, `silent` while it hangs, `gone` when it ended without a
            word, `ended` when it said how.
        session: of the run; None while idle.
        published: what its control server published last.
        last_answer: when that was, by `time.monotonic()`.
        others: how many other runs of this folder are alive.
    """

    state: State = "idle"
    session: SessionFile | None = None
    published: Mapping[str, Any] = field(default_factory=dict)
    last_answer: float = field(default_factory=time.monotonic)
    others: int = 0

    @property
    def fact(self) -> Mapping[str, Any]:
        """What its session file says; empty while idle."""
        return {} if self.session is None else self.session.facts


class ControllerWatch:
    """Follows the newest run of a folder, in a thread.

    Args:
        runs: folder of all bundles.
        pages: returns how many pages are open, for the control server.
    """

    def __init__(self, runs: Path, pages: Callable[[], int]) -> None:
        self._runs, self._pages = runs, pages
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look, name="controller", daemon=True)
        self.now = Controller()

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def close(self) -> None:
        """Look no more."""
        self._ended.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._ended.wait(LOOK_S):
            try:
                self._look_once()
            except Exception:  # what cannot be understood now must not blind the page for good
                traceback.print_exc()

    def _look_once(self) -> None:
        session, others = self._newest()
        if session is None or self._known_to_have_ended(session):
            return
        try:
            with watch(session) as line:
                self._follow(line, Controller("alive", session, others=others))
        except (ControllerGone, OSError):
            self.now = replace(self._same(session), state="gone", others=others)

    def _newest(self) -> tuple[SessionFile | None, int]:
        """Return the newest run that is alive, else the newest that left a session file."""
        found = session_files(self._runs)
        alive = [session for session in found if holder(self._runs, session.experiment)]
        newest = (alive or found or [None])[-1]
        return newest, sum(session is not newest for session in alive)

    def _known_to_have_ended(self, session: SessionFile) -> bool:
        return self.now.state == "ended" and self.now.fact.get("token") == session.facts.get(
            "token"
        )

    def _same(self, session: SessionFile) -> Controller:
        """Return what is known of a run that was seen before."""
        known = self.now.fact.get("token") == session.facts.get("token")
        return self.now if known else Controller(session=session)

    def _follow(self, line: MessageLine, begun: Controller) -> None:
        """Take what the control server publishes until the run ends; OSError when it is gone."""
        self.now = begun
        looked = time.monotonic()
        while not self._ended.is_set():
            published = line.receive(ANSWER_S)
            if published is None:
                self.now = replace(self.now, state="silent")
                continue
            state: State = "alive" if published.get("ended") is None else "ended"
            self.now = replace(
                self.now, state=state, published=published, last_answer=time.monotonic()
            )
            if state == "ended":
                return
            with suppress(OSError):  # it has ended: what it said before that is still to be read
                line.send({"pages": self._pages()})
            if time.monotonic() - looked > 1.0:
                looked = time.monotonic()
                self.now = replace(self.now, others=self._newest()[1])
