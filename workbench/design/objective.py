"""The fitness of candidates: simulated together on all cores, each failure a penalty of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.design.goals import GOALS, PENALTY, Hop
from workbench.design.problem import Problem
from workbench.design.uncertainty import altered
from workbench.errors import InputError
from workbench.optimize import Evaluation
from workbench.sim import Condition, Fanout, Outcome, Robot, Simulation, applied, unloaded

__all__ = ["Objective"]

Job = tuple[Robot, Condition]

_ENDINGS: dict[Outcome, str] = {
    "fell": "the robot fell: T came below 0.05 m",
    "diverged": "the simulation blew up",
}


class Objective:
    """Evaluates candidates of a problem; depends on nothing but the candidate.

    A shape that cannot be bent, a robot that does not stand, a fall and a crash get the
    penalty a + 2. In a robust problem every candidate hops once for each draw, a draw that fails
    gets the penalty, and the candidate fails when all do.

    Args:
        problem: that the candidates are of.
        fanout: what simulates them.
    """

    def __init__(self, problem: Problem, fanout: Fanout) -> None:
        self.problem = problem
        self._fanout = fanout
        self._strip = problem.strip

    def __call__(self, candidates: NDArray[np.float64]) -> list[Evaluation]:
        """Return the evaluations of candidates (n, d), in their order.

        Raises:
            WorkbenchError: when the cluster is lost; a candidate's own failure never raises.
        """
        refused = [self._refusal(candidate) for candidate in candidates]
        jobs = [
            list(self._jobs(c)) if r is None else []
            for c, r in zip(candidates, refused, strict=True)
        ]
        results = iter(
            self._fanout.attempt(
                [job for batch in jobs for job in batch], self._strip.require_upright
            )
        )
        return [
            self._failed(refusal)
            if refusal is not None
            else self._judged(batch, [next(results) for _ in batch])
            for batch, refusal in zip(jobs, refused, strict=True)
        ]

    def bendable(self, candidate: NDArray[np.float64]) -> bool:
        """Return whether a candidate is inside the bounds and can be bent; nothing is simulated.

        Args:
            candidate: (d,) the variables of the problem's space [SI].
        """
        return self._refusal(candidate) is None

    def _refusal(self, candidate: NDArray[np.float64]) -> str | None:
        if not self.problem.space.contains(candidate):
            return "the candidate is outside the bounds of the angles or of their sum"
        try:
            free = unloaded(applied(self.problem.robot(candidate)))
            self._strip.require_bendable(free.angles)
        except InputError as refusal:
            return str(refusal)
        return None

    def _jobs(self, candidate: NDArray[np.float64]) -> Iterator[Job]:
        robot = self.problem.robot(candidate)
        if self.problem.uncertainty is None:
            yield robot, self.problem.condition(candidate)
            return
        for departure in self.problem.uncertainty.departures:
            condition = self.problem.condition(candidate, departure)
            yield altered(robot, departure), condition

    def _failed(self, why: str) -> Evaluation:
        return Evaluation((PENALTY,) * len(self.problem.goals), {}, why)

    def _judged(
        self, jobs: Sequence[Job], results: Sequence[Simulation | InputError]
    ) -> Evaluation:
        hops = [self._hop(robot, result) for (robot, _), result in zip(jobs, results, strict=True)]
        good = [hop for hop in hops if isinstance(hop, Hop)]
        if not good:
            return self._failed(next(hop for hop in hops if isinstance(hop, str)))
        values = {goal.name: [goal.value(hop) for hop in good] for goal in GOALS.values()}
        numbers = {goal.column: float(np.mean(values[name])) for name, goal in GOALS.items()}
        uncertainty = self.problem.uncertainty
        fitness = self._fitness(values, len(hops) - len(good))
        if uncertainty is None:
            return Evaluation(tuple(map(float, fitness[0])), numbers)
        numbers |= {"failed_draws": float(len(hops) - len(good))}
        numbers |= {
            f"spread_{goal.column}": float(np.std(values[goal.name], ddof=len(good) > 1))
            for goal in self.problem.goals
        }
        return Evaluation(tuple(map(float, uncertainty.fitness(fitness))), numbers)

    def _fitness(self, values: Mapping[str, Sequence[float]], failed: int) -> NDArray[np.float64]:
        """Return the fitness of every draw by every goal, (draws, goals)."""
        columns = [
            [goal.fitness(value) for value in values[goal.name]] + failed * [PENALTY]
            for goal in self.problem.goals
        ]
        return np.column_stack(columns)

    def _hop(self, robot: Robot, result: Simulation | InputError) -> Hop | str:
        """Return the hop, or why there is none."""
        if isinstance(result, InputError):
            return str(result)
        if result.outcome != "completed":
            return f"{_ENDINGS[result.outcome]} after {result.motion.times[-1]:.2f} s"
        return Hop(robot, result, self.problem.duration)
