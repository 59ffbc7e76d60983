"""The progress line of long work: stage, share and time left, on the terminal only."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO, cast

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from workbench.progress import Stage

__all__ = ["ProgressLine"]

_QUIET_S = 2.0  # what ends sooner needs no line
_BAR_CELLS = 24
_REDRAWN_HZ = 4.0


class ProgressLine:
    """Shows each stage of a verb; called with a stage as it begins.

    On a terminal the stage in progress is one line that stays in place, with its share and the time
    left where they are known; when it is over its words stay, with the time that it took. Whatever
    is printed on stdout ends it, so that a result begins on a line of its own. Anywhere else each
    stage is one plain line.

    Args:
        console: of the text for people; never stdout.
        clock: monotonic [s].
    """

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self.quiet = False
        self.console, self._clock = console, clock
        self._stage = Stage("")
        self._began = 0.0
        self._first = self._last = (0.0, 0.0)  # times [s] and shares, of one piece of work
        self._live: Live | None = None
        self._stdout: TextIO | None = None  # sys.stdout as it was before the line

    def __call__(self, stage: str) -> None:
        """Show that a stage begins."""
        if self.quiet:
            return
        if not self.console.is_interactive:
            self._print(stage)
            return
        self._end_stage()
        self._began = self._clock()
        self._follow(stage)
        if self._live is None:
            self._live = self._started()

    def update(self, stage: str) -> None:
        """Change words and share of the stage in progress; off a terminal nothing is printed."""
        if self._live is not None:
            self._follow(stage)

    def note(self, text: str, style: str | None = None, end: str = "\n") -> None:
        """Print a text above the line, which stays."""
        self.console.print(text, style=style, markup=False, end=end)

    def pause(self) -> None:
        """Leave the terminal to others; the next stage takes it again."""
        if self._live is not None:
            if self._stdout is not None:
                sys.stdout, self._stdout = self._stdout, None
            self._live.stop()
            self._live = None
            self._end_stage()
            self._stage = Stage("")

    def line(self) -> Table | Text:
        """Return the line as it is now; empty while the stage is too short to be shown."""
        now = self._clock()
        if not self._stage or now - self._first[0] < _QUIET_S:
            return Text("")
        row = Table.grid(padding=(0, 1))
        cells: list[Text | ProgressBar] = [
            Text(f"  {self._stage}", overflow="ellipsis", no_wrap=True)
        ]
        share = self._stage.share
        if share is None and self._stage.seconds:
            share = min((now - self._began) / self._stage.seconds, 1.0)
        if share is not None:
            cells.append(ProgressBar(1.0, share, _BAR_CELLS))
            cells.append(Text(f"{share:.0%}"))
        cells.append(Text(_minutes(now - self._began), style="dim"))
        if (left := self.left()) is not None:
            cells.append(Text(f"{_minutes(left)} left"))
        row.add_row(*cells)
        return row

    def left(self) -> float | None:
        """Return the time left [s], as the work went so far or of this stage; None if unknown."""
        now, stage = self._clock(), self._stage
        (first, none), (last, done) = self._first, self._last
        if stage.share is not None and done > none:
            left = (1 - done) * (last - first) / (done - none) - (now - last)
            return left if left > 0 else None  # a stage takes longer than all before promised
        if stage.share is None and stage.seconds is not None:
            return max(0.0, stage.seconds - (now - self._began))
        return None

    def _follow(self, words: str) -> None:
        """Keep a stage; a smaller share than the last begins another piece of work."""
        stage = words if isinstance(words, Stage) else Stage(words)
        before, share = self._stage.share, stage.share
        if share is None or before is None or share < before:
            self._first = self._last = (self._clock(), share or 0.0)
        elif share > before:
            self._last = (self._clock(), share)
        self._stage = stage

    def _end_stage(self) -> None:
        """Print the words of the stage that ends, and how long it took if it took long."""
        if self._stage:
            took = self._clock() - self._began
            self._print(self._stage + (f"  {_minutes(took)}" if took >= _QUIET_S else ""))

    def _print(self, words: str) -> None:
        self.console.print(f"  {words}", style="dim", markup=False)

    def _started(self) -> Live:
        """Start the line on the terminal; text printed meanwhile appears above it."""
        live = Live(
            console=self.console,
            get_renderable=self.line,
            refresh_per_second=_REDRAWN_HZ,
            transient=True,
            redirect_stdout=False,
        )
        live.start()
        if sys.stdout.isatty():  # what goes to a file does not disturb the line
            self._stdout = results = sys.stdout
            sys.stdout = cast(TextIO, _Results(results, self.pause))
        return live


class _Results:
    """Standard output while the line is on the terminal: the first text ends the line."""

    def __init__(self, stdout: TextIO, end_line: Callable[[], None]) -> None:
        self._stdout, self._end_line = stdout, end_line

    def write(self, text: str) -> int:
        self._end_line()
        return self._stdout.write(text)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stdout, name)


def _minutes(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02}"
