"""What a search says of itself: candidates, best, mean and rate, after each generation."""

from __future__ import annotations

from workbench.design.goals import Goal
from workbench.optimize import History
from workbench.progress import Stage

__all__ = ["search_stage"]

_RECENT = 5  # generations that the rate is taken over


def search_stage(goal: Goal, history: History, total: int) -> Stage:
    """Return the state of a search, in one line.

    Args:
        goal: the first one, whose values are shown.
        history: so far.
        total: candidates that are asked for in all.
    """
    recent = history.generations[-_RECENT:]
    seconds = sum(generation.seconds for generation in recent)
    rate = sum(len(generation.trials) for generation in recent) / max(seconds, 1e-9)
    best, mean = (
        goal.value_of(fitness)
        for fitness in (history.best.evaluation.fitness[0], history.generations[-1].mean)
    )
    words = f"{history.asked}/{total}  best {best:.3g}  mean {mean:.3g}  {rate:.1f}/s"
    return Stage(words, history.asked / max(total, 1))
