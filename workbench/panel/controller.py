"""Which process carries out a run, and whether it is alive: by its desk, not by its number."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from workbench.desk import Card, cards, holder, watch
from workbench.errors import ControllerGone
from workbench.loopback import Line

__all__ = ["Controller", "ControllerWatch", "State"]

State = Literal["idle", "alive", "silent", "gone", "ended"]

LOOK_S = 0.2
"""How often a new run is looked for [s]."""
SILENT_S = 0.8
"""A desk that says nothing for so long belongs to a process that hangs [s]."""


@dataclass(frozen=True)
class Controller:
    """The process that carries out a run, as it is known here.

    Args:
        state: `idle` before the first, `silent` while it hangs, `gone` when it ended without a
            word, `ended` when it said how.
        card: of the run; None while idle.
        shown: what its desk showed last.
        heard: when that was, by `time.monotonic()`.
        others: how many other runs of this folder are alive.
    """

    state: State = "idle"
    card: Card | None = None
    shown: Mapping[str, Any] = field(default_factory=dict)
    heard: float = field(default_factory=time.monotonic)
    others: int = 0

    @property
    def fact(self) -> Mapping[str, Any]:
        """What its card says; empty while idle."""
        return {} if self.card is None else self.card.facts


class ControllerWatch:
    """Follows the newest run of a folder, in a thread.

    Args:
        runs: folder of all bundles.
        pages: tells how many pages are open, for the desk.
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
        card, others = self._newest()
        if card is None or self._known_to_have_ended(card):
            return
        try:
            with watch(card) as line:
                self._follow(line, Controller("alive", card, others=others))
        except (ControllerGone, OSError):
            self.now = replace(self._same(card), state="gone", others=others)

    def _newest(self) -> tuple[Card | None, int]:
        """Return the newest run that is alive, else the newest that left a card."""
        found = cards(self._runs)
        alive = [card for card in found if holder(self._runs, card.experiment)]
        newest = (alive or found or [None])[-1]
        return newest, sum(card is not newest for card in alive)

    def _known_to_have_ended(self, card: Card) -> bool:
        return self.now.state == "ended" and self.now.fact.get("token") == card.facts.get("token")

    def _same(self, card: Card) -> Controller:
        """Return what is known of a run that was seen before."""
        known = self.now.fact.get("token") == card.facts.get("token")
        return self.now if known else Controller(card=card)

    def _follow(self, line: Line, begun: Controller) -> None:
        """Take what the desk shows until the run ends; raises OSError when it is gone."""
        self.now = begun
        looked = time.monotonic()
        while not self._ended.is_set():
            shown = line.receive(SILENT_S)
            if shown is None:
                self.now = replace(self.now, state="silent")
                continue
            state: State = "alive" if shown.get("ended") is None else "ended"
            self.now = replace(self.now, state=state, shown=shown, heard=time.monotonic())
            if state == "ended":
                return
            line.send({"pages": self._pages()})
            if time.monotonic() - looked > 1.0:
                looked = time.monotonic()
                self.now = replace(self.now, others=self._newest()[1])
