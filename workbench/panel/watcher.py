"""Keeps what the page shows up to date; no page that is slow, and no disk, holds up STOP."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from workbench.panel.controller import Controller, ControllerWatch
from workbench.panel.journal_tail import JournalTail
from workbench.panel.listing import Listing
from workbench.panel.result import experiment_verdict
from workbench.panel.view import clocks, view

__all__ = ["Snapshot", "Watcher"]

StartShown = Callable[[Mapping[str, Any]], Mapping[str, str] | None]

TICK_S = 0.1
"""How often the journal is looked at [s]."""
LIST_S = 1.0
"""How often the list of runs is looked at [s]."""


@dataclass(frozen=True)
class Snapshot:
    """What the page shows at one instant.

    Args:
        state: everything but times and readings.
        clocks: times [s], as they were at `made`.
        runs: the list.
        following: the run whose readings are plotted; None before the first.
        made: by `time.monotonic()`.
    """

    state: dict[str, Any] = field(default_factory=dict)
    clocks: dict[str, Any] = field(default_factory=dict)
    runs: dict[str, Any] = field(default_factory=dict)
    following: JournalTail | None = None
    made: float = field(default_factory=time.monotonic)


class Watcher:
    """Looks at a folder of runs, in a thread of its own.

    Args:
        runs: folder of all bundles.
        start_facts: returns what is shown of a run that was started here and has no session yet, by
            the facts of the session that is shown.

    Attributes:
        picture: the newest; replaced, never changed.
        listing: of the runs.
        pages: how many pages are open now.
    """

    def __init__(self, runs: Path, start_facts: StartShown = lambda fact: None) -> None:
        self.runs = runs
        self._start_facts = start_facts
        self.pages = 0
        self.listing = Listing(runs)
        self.picture = Snapshot()
        self._controller = ControllerWatch(runs, lambda: self.pages)
        self._following: JournalTail | None = None
        self._listed = (0.0, 0)
        self._verdict = (0, 0)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="watcher", daemon=True)

    @property
    def controller(self) -> Controller:
        """The process that carries out the run that is shown."""
        return self._controller.now

    def __enter__(self) -> Watcher:
        """Begin to look."""
        self._tick()
        self._controller.start()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Look no more."""
        self._ended.set()
        self._thread.join()
        self._controller.close()

    def _watch(self) -> None:
        while not self._ended.wait(TICK_S):
            try:
                self._tick()
            except Exception:  # what cannot be shown now must not blind the page for good
                traceback.print_exc()

    def _tick(self) -> None:
        controller = self._controller.now
        runs = self._list(controller.session.experiment if controller.session else None)
        self._follow(controller.session.experiment if controller.session else None)
        following = self._following
        if following is not None:
            following.read_on()
        state = view(controller, following, self._verdict)
        fact = {} if controller.state == "gone" else controller.fact  # nobody may have received it
        state |= {"start": self._start_facts(fact)}
        self.picture = Snapshot(state, clocks(controller, following), runs, following)

    def _list(self, experiment: str | None) -> dict[str, Any]:
        """Return the list of runs, anew where one was added or a while has passed."""
        looked, changed = self._listed
        newest = self.runs.stat().st_mtime_ns if self.runs.is_dir() else 0
        if newest == changed and time.monotonic() - looked < LIST_S and self.picture.runs:
            return self.picture.runs
        self._listed = (time.monotonic(), newest)
        self.listing.refresh()
        self._verdict = experiment_verdict(self.listing.of(experiment)) if experiment else (0, 0)
        return self.listing.rows()

    def _follow(self, experiment: str | None) -> None:
        """Follow the newest run of the experiment that is carried out."""
        bundle = None if experiment is None else self.listing.newest_of(experiment)
        if bundle is None:
            self._following = None
        elif self._following is None or self._following.bundle.path != bundle.path:
            self._following = JournalTail(bundle)
        else:
            self._following.bundle = bundle  # its manifest may have grown
