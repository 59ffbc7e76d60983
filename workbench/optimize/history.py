"""What a search did: every generation with its candidates, and the best of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import WorkbenchError
from workbench.optimize.evaluation import Evaluation

__all__ = ["Generation", "History", "Trial"]

_COLUMNS = ("generation", "best", "mean", "best so far", "failures", "evaluated", "seconds")


@dataclass(frozen=True, eq=False)
class Trial:
    """A candidate with its evaluation.

    Args:
        candidate: (d,) [unit of each variable].
        evaluation: of it.
    """

    candidate: NDArray[np.float64]
    evaluation: Evaluation


@dataclass(frozen=True, eq=False)
class Generation:
    """What was asked for at once.

    Args:
        trials: in the order asked.
        evaluated: how many of them were new; the others were known already.
        seconds: wall time of asking, evaluating and telling [s].
    """

    trials: tuple[Trial, ...]
    evaluated: int
    seconds: float

    @property
    def fitness(self) -> NDArray[np.float64]:
        """Fitness with penalties, (n, goals) [unit of each goal]."""
        return np.array([trial.evaluation.fitness for trial in self.trials])

    @property
    def failures(self) -> tuple[str, ...]:
        """Why candidates failed, one text for each that did."""
        texts = (trial.evaluation.failure for trial in self.trials)
        return tuple(text for text in texts if text is not None)

    @property
    def best(self) -> Trial:
        """The trial of the least first goal."""
        return self.trials[int(np.argmin(self.fitness[:, 0]))]

    @property
    def mean(self) -> float:
        """Mean first goal of the candidates that did not fail; NaN when all did."""
        good = [t.evaluation.fitness[0] for t in self.trials if t.evaluation.failure is None]
        return float(np.mean(good)) if good else float("nan")


@dataclass(frozen=True, eq=False)
class History:
    """All generations of a search, in order.

    Args:
        names: of the variables, (d,).
        generations: none before the first.
    """

    names: tuple[str, ...]
    generations: tuple[Generation, ...] = ()

    @property
    def asked(self) -> int:
        """How many candidates were asked for, those that were known already included."""
        return sum(len(generation.trials) for generation in self.generations)

    @property
    def evaluated(self) -> int:
        """How many candidates were evaluated."""
        return sum(generation.evaluated for generation in self.generations)

    @property
    def seconds(self) -> float:
        """Wall time of all generations [s]."""
        return sum(generation.seconds for generation in self.generations)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Every trial in the order asked."""
        return tuple(trial for generation in self.generations for trial in generation.trials)

    @property
    def best(self) -> Trial:
        """The first trial of the least first goal.

        Raises:
            WorkbenchError: when there is no generation yet.
        """
        if not self.generations:
            raise WorkbenchError("the search has no generation yet; give it more evaluations")
        return min(self.trials, key=lambda trial: trial.evaluation.fitness[0])

    def front(self) -> tuple[Trial, ...]:
        """Return the trials that no other beats in all goals, by rising first goal.

        A trial that failed is not among them, of equal ones only the first is.
        """
        good = [trial for trial in self.trials if trial.evaluation.failure is None]
        unique = {trial.evaluation.fitness: trial for trial in reversed(good)}
        fitness = np.array(list(unique))
        chosen = [
            trial
            for one, trial in unique.items()
            if not np.any(np.all(fitness <= one, axis=1) & np.any(fitness < one, axis=1))
        ]
        return tuple(sorted(chosen, key=lambda trial: trial.evaluation.fitness))

    def columns(self) -> Mapping[str, NDArray[np.float64]]:
        """Return the table of the generations: heading -> (generations,) [unit of its heading]."""
        best = [g.best.evaluation.fitness[0] for g in self.generations]
        values = (
            np.arange(1, len(best) + 1),
            best,
            [g.mean for g in self.generations],
            np.minimum.accumulate(np.array(best)) if best else [],
            [len(g.failures) for g in self.generations],
            [g.evaluated for g in self.generations],
            [g.seconds for g in self.generations],
        )
        return {
            name: np.array(column, dtype=np.float64)
            for name, column in zip(_COLUMNS, values, strict=True)
        }

    def table(self) -> str:
        """Return the generations as lines of text, with a heading."""
        rows = zip(*self.columns().values(), strict=True)
        lines = [
            f"{'':>4}{'best':>12}{'mean':>12}{'best so far':>13}{'failures':>10}"
            f"{'evaluated':>11}{'seconds':>9}"
        ]
        lines += [
            f"{n:4.0f}{best:12.6g}{mean:12.6g}{so_far:13.6g}{failures:10.0f}{new:11.0f}{wall:9.2f}"
            for n, best, mean, so_far, failures, new, wall in rows
        ]
        return "\n".join(lines)
