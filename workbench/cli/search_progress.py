"""What a search tells of itself: best, mean, rate and time left of each generation."""

from __future__ import annotations

from workbench.cli.progress import ProgressLine
from workbench.design import Goal
from workbench.optimize import History
from workbench.progress import Stage

__all__ = ["SearchProgress"]

_RECENT = 5  # generations that the rate is taken over


class SearchProgress:
    """Told of each generation of a search: best, mean and rate.

    Args:
        goal: the first one, whose values are shown.
        tell: where the line is shown.
    """

    def __init__(self, goal: Goal, tell: ProgressLine) -> None:
        self._goal, self._tell = goal, tell

    def __call__(self, history: History, total: int) -> None:
        """Show where the search stands."""
        self._tell.update(Stage(self.words(history, total), history.asked / max(total, 1)))

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
