"""Spaces, objectives and algorithms that the tests of the searches share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.optimize import (
    Algorithm,
    Cmaes,
    CmaesOptions,
    Evaluation,
    Generation,
    GeneticAlgorithm,
    GeneticOptions,
    Guided,
    GuidedOptions,
    History,
    Pareto,
    Space,
    Trial,
)

START = (-2.558, 0.01, 0.112, 0.042, 0.084, 0.126, 0.130, 0.217,
         0.182, 0.339, 0.339, 0.347, 0.399, 0.234, 0.344, 0.175)  # fmt: skip
NAMES = tuple(f"alpha_{k}" for k in range(16))

ALGORITHMS: dict[str, Callable[[Space, int], Algorithm]] = {
    "ga": GeneticAlgorithm,
    "ga, Gaussian": lambda space, seed: GeneticAlgorithm(
        space, seed, GeneticOptions(mutation_fcn="mutationgaussian")
    ),
    "ga, from the whole space": lambda space, seed: GeneticAlgorithm(
        space, seed, GeneticOptions(creation_fcn="gacreationlinearfeasible", population_size=8)
    ),
    "cma": Cmaes,
    "cma, impatient": lambda space, seed: Cmaes(space, seed, CmaesOptions(patience=2)),
    "guided": Guided,
    "guided, two niches": lambda space, seed: Guided(
        space, seed, options=GuidedOptions(population_size=8, first=1, niches=2)
    ),
    "nsga2": Pareto,
}


def beam() -> Space:
    """Return the angles of the thesis with the bounds of eq. 5.2 and 5.3 and the sum's."""
    lower = [-3.0, *[-0.1] * 3, *[0.0] * 12]
    upper = [-1.0, *[0.5] * 3, *[0.6] * 12]
    return Space(
        NAMES,
        np.array(lower),
        np.array(upper),
        np.array(START),
        summed=NAMES[1:],
        sum_lower=-0.1,
        sum_upper=1.2 * np.pi,
    )


def ridges(goals: int = 1) -> Callable[[NDArray[np.float64]], Sequence[Evaluation]]:
    """Return an objective with many minima, falls and a candidate's crash in every hundred."""
    targets = beam().sample(np.random.default_rng(1), goals)

    def evaluate(candidates: NDArray[np.float64]) -> list[Evaluation]:
        return [one(candidate) for candidate in candidates]

    def one(candidate: NDArray[np.float64]) -> Evaluation:
        if np.sin(1e4 * candidate.sum()) > 0.999:
            raise FloatingPointError(f"blew up at {candidate[0]:.3f}")
        far = np.sum((candidate - targets) ** 2, axis=1) + 0.02 * np.sin(40 * candidate).sum()
        if candidate[3] > 0.3:
            return Evaluation((102.0,) * goals, {"distance_m": float("nan")}, "fell after 3 s")
        return Evaluation(tuple(far.tolist()), {"distance_m": float(1 - far[0])})

    return evaluate


def facts(history: History) -> list[tuple[object, ...]]:
    """Return all of a history but its times, to be compared bit for bit."""
    return [
        (number, generation.evaluated, trial.candidate.tobytes(), trial.evaluation.fitness,
         trial.evaluation.failure, repr(dict(trial.evaluation.numbers)))
        for number, generation in enumerate(history.generations)
        for trial in generation.trials
    ]  # fmt: skip


def three() -> History:
    """Return a history of three generations, some of whose trials failed."""
    return History(
        ("a", "b"),
        (
            _generation((99.0, None), (102.0, "fell"), (99.5, None)),
            _generation((99.4, None), (98.6, None), (102.0, "fell")),
            _generation((102.0, "fell"), (102.0, "crashed"), (102.0, "fell")),
        ),
    )


def _generation(*rows: tuple[float, str | None]) -> Generation:
    trials = [
        Trial(np.array([f, -f]), Evaluation((f, -f), {"distance_m": 100 - f}, why))
        for f, why in rows
    ]
    return Generation(tuple(trials), len(trials) - 1, 0.5)
