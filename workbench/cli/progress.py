"""The live line of a search: best, mean, evaluations a second, time left."""

from __future__ import annotations

import time
from types import TracebackType

from rich.progress import BarColumn, Progress, TextColumn

from workbench.cli.output import people
from workbench.design import Goal
from workbench.optimize import History

__all__ = ["SearchProgress"]

_QUIET_S = 2.0  # what ends sooner needs no bar
_RECENT = 5  # generations that the rate is taken over


class SearchProgress:
    """Told of each generation; draws on a terminal only, and only when the search takes long.

    Args:
        goal: the first one, whose values are shown.
        total: evaluations of the whole search.
    """

    def __init__(self, goal: Goal, total: int) -> None:
        self._goal = goal
        self._total = total
        self._begin = time.monotonic()
        self._bar: Progress | None = None

    def __enter__(self) -> SearchProgress:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Leave the last line on the screen."""
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, history: History, total: int) -> None:
        """Show where the search stands."""
        if not people.is_terminal or time.monotonic() - self._begin < _QUIET_S:
            return
        if self._bar is None:
            columns = (
                TextColumn("{task.description}"),
                BarColumn(24),
                TextColumn("{task.fields[told]}"),
            )
            self._bar = Progress(*columns, console=people)
            self._bar.start()
            self._bar.add_task("searching", total=self._total, told="")
        self._bar.update(self._bar.task_ids[0], completed=history.asked, told=self.line(history))

    def line(self, history: History) -> str:
        """Return best, mean, rate and time left in one line."""
        recent = history.generations[-_RECENT:]
        seconds = sum(generation.seconds for generation in recent)
        rate = sum(len(generation.trials) for generation in recent) / max(seconds, 1e-9)
        left = max(0, self._total - history.asked) / max(rate, 1e-9)
        best, mean = (
            self._goal.value_of(fitness)
            for fitness in (history.best.evaluation.fitness[0], history.generations[-1].mean)
        )
        return (
            f"{history.asked}/{self._total}  best {best:.3g}  mean {mean:.3g}  "
            f"{rate:.1f}/s  {left / 60:.0f}:{left % 60:02.0f} left"
        )
