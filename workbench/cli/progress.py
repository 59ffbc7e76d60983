"""The one line that tells what takes long: phase, share and time left, on the terminal only."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from workbench.design import Goal
from workbench.optimize import History
from workbench.progress import Phase

__all__ = ["Phases", "SearchProgress"]

_QUIET_S = 2.0  # what ends sooner needs no line
_BAR_CELLS = 24
_REDRAWN_HZ = 4.0
_RECENT = 5  # generations that the rate is taken over


class Phases:
    """Is told each phase of a verb as it begins.

    On a terminal the phase that lasts is one line that stays in place, with its share and the time
    left where they are known; when it is over its words stay, with the time that it took. Anywhere
    else each phase is one plain line.

    Args:
        console: of the text for people; never stdout.
        clock: monotonic [s].
    """

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self.quiet = False
        self._console, self._clock = console, clock
        self._phase = Phase("")
        self._began = 0.0
        self._first = self._last = (0.0, 0.0)  # times [s] and shares, of one piece of work
        self._live: Live | None = None

    def __call__(self, phase: str) -> None:
        """Tell that a phase begins."""
        if self.quiet:
            return
        if not self._console.is_interactive:
            self._print(phase)
            return
        self._leave()
        self._enter(phase if isinstance(phase, Phase) else Phase(phase))
        if self._live is None:
            self._live = self._started()

    def update(self, phase: Phase) -> None:
        """Change words and share of the phase that lasts; off a terminal nothing is told."""
        if self._live is not None:
            self._follow(phase)

    def pause(self) -> None:
        """Leave the terminal to others; the next phase takes it again."""
        if self._live is not None:
            self._live.stop()
            self._live = None
            self._leave()
            self._phase = Phase("")

    def line(self) -> Table | Text:
        """Return the line as it is now; empty as long as nothing has lasted."""
        now = self._clock()
        if not self._phase or now - self._first[0] < _QUIET_S:
            return Text("")
        row = Table.grid(padding=(0, 1))
        cells: list[Text | ProgressBar] = [Text(f"  {self._phase}")]
        if self._phase.share is not None:
            cells.append(ProgressBar(1.0, self._phase.share, _BAR_CELLS))
            cells.append(Text(f"{self._phase.share:.0%}"))
        cells.append(Text(_minutes(now - self._began), style="dim"))
        if (left := self.left()) is not None:
            cells.append(Text(f"{_minutes(left)} left"))
        row.add_row(*cells)
        return row

    def left(self) -> float | None:
        """Return the time left [s], as the work went so far or of this phase; None if unknown."""
        now, phase = self._clock(), self._phase
        (first, none), (last, done) = self._first, self._last
        if phase.share is not None and done > none:
            return max(0.0, (1 - done) * (last - first) / (done - none) - (now - last))
        if phase.seconds is not None:
            return max(0.0, phase.seconds - (now - self._began))
        return None

    def _enter(self, phase: Phase) -> None:
        self._began = self._clock()
        self._follow(phase)

    def _follow(self, phase: Phase) -> None:
        """Keep a phase; one that is less far than the last begins another piece of work."""
        before, share = self._phase.share, phase.share
        if share is None or before is None or share < before:
            self._first = self._last = (self._clock(), share or 0.0)
        elif share > before:
            self._last = (self._clock(), share)
        self._phase = phase

    def _leave(self) -> None:
        """Keep the words of the phase that ends, and how long it took if it took long."""
        if self._phase:
            took = self._clock() - self._began
            self._print(self._phase + (f"  {_minutes(took)}" if took >= _QUIET_S else ""))

    def _print(self, words: str) -> None:
        self._console.print(f"  {words}", style="dim", markup=False)

    def _started(self) -> Live:
        """Return the line on the terminal; what is printed meanwhile appears above it."""
        live = Live(
            console=self._console,
            get_renderable=self.line,
            refresh_per_second=_REDRAWN_HZ,
            transient=True,
            redirect_stdout=sys.stdout.isatty(),  # a file on stdout must not be written to stderr
        )
        live.start()
        return live


class SearchProgress:
    """Told of each generation of a search: best, mean and rate.

    Args:
        goal: the first one, whose values are shown.
        tell: where the line is shown.
    """

    def __init__(self, goal: Goal, tell: Phases) -> None:
        self._goal, self._tell = goal, tell

    def __call__(self, history: History, total: int) -> None:
        """Show where the search stands."""
        self._tell.update(Phase(self.words(history, total), history.asked / max(total, 1)))

    def words(self, history: History, total: int) -> str:
        """Return candidates, best, mean and rate in one line."""
        recent = history.generations[-_RECENT:]
        seconds = sum(generation.seconds for generation in recent)
        rate = sum(len(generation.trials) for generation in recent) / max(seconds, 1e-9)
        best, mean = (
            self._goal.value_of(fitness)
            for fitness in (history.best.evaluation.fitness[0], history.generations[-1].mean)
        )
        return f"{history.asked}/{total}  best {best:.3g}  mean {mean:.3g}  {rate:.1f}/s"


def _minutes(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02}"
