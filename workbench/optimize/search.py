"""Search a space for the least fitness: the loop of asking, evaluating and telling."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, WorkbenchError
from workbench.optimize.algorithm import Algorithm
from workbench.optimize.checkpoint import Checkpoint, CheckpointFile
from workbench.optimize.evaluation import Evaluate, Evaluation, candidate_key
from workbench.optimize.history import Generation, History, Trial

__all__ = ["Watch", "search"]

Watch = Callable[[History, int], None]
"""Receives, after each generation, the history so far and the evaluations asked for in all."""


def search(
    problem_id: str,
    algorithm: Algorithm,
    evaluate: Evaluate,
    *,
    evaluations: int,
    penalty: Sequence[float],
    checkpoint: Path | None = None,
    watch: Watch | None = None,
) -> History:
    """Let an algorithm search its space until its next generation would exceed the evaluations.

    It ends earlier when the algorithm has nothing more to ask.

    A candidate that was evaluated before, an elite, is not evaluated again; it counts as one of the
    evaluations all the same, so that algorithms are compared by how often they ask. An evaluation
    that raises is a penalty with its reason in the history; an error of the workbench, such as a
    lost cluster or an interruption, ends the search, which goes on from its checkpoint.

    Args:
        problem_id: what distinguishes the objective from every other, the speed for example.
        algorithm: with its space; it begins, or goes on where the checkpoint left it.
        evaluate: the objective.
        evaluations: how many candidates may be asked for, generations being whole.
        penalty: fitness of an evaluation that raised or gave no finite number, one for each goal.
        checkpoint: written after generations and at the end, however it comes; where it exists,
            the search goes on from it.
        watch: called after each generation; what it raises ends the search.

    Raises:
        InputError: when the checkpoint is of another search, torn or edited.
    """
    _require_penalty(penalty, algorithm)
    history = _begin(problem_id, algorithm, checkpoint)
    file = CheckpointFile(checkpoint, problem_id, algorithm)
    try:
        while True:
            begin = time.perf_counter()
            candidates = algorithm.ask()
            if not len(candidates) or history.asked + len(candidates) > evaluations:
                return history
            trials, new = _try(problem_id, candidates, evaluate, history, tuple(penalty))
            _tell_fitness(algorithm, candidates, trials)
            generation = Generation(trials, new, time.perf_counter() - begin)
            history = replace(history, generations=(*history.generations, generation))
            file.keep(history)
            if watch:
                watch(history, evaluations)
    finally:
        file.flush()


def _require_penalty(penalty: Sequence[float], algorithm: Algorithm) -> None:
    if len(penalty) != algorithm.goals:
        raise InputError(
            f"{algorithm.name} takes {algorithm.goals} goals, the penalty has {len(penalty)}"
        )


def _tell_fitness(
    algorithm: Algorithm, candidates: NDArray[np.float64], trials: Sequence[Trial]
) -> None:
    fitness = np.array([trial.evaluation.fitness for trial in trials])
    algorithm.tell(candidates, fitness[:, 0] if algorithm.goals == 1 else fitness)


def _begin(problem_id: str, algorithm: Algorithm, checkpoint: Path | None) -> History:
    if checkpoint is None or not checkpoint.exists():
        return History(algorithm.space.names)
    found = Checkpoint.read(checkpoint, problem_id, algorithm)
    algorithm.restore(found.state)
    return found.history


def _try(
    problem_id: str,
    candidates: NDArray[np.float64],
    evaluate: Evaluate,
    history: History,
    penalty: tuple[float, ...],
) -> tuple[tuple[Trial, ...], int]:
    """Return the candidates with their evaluations, and how many of these were new."""
    keys = [candidate_key(problem_id, candidate) for candidate in candidates]
    known = {candidate_key(problem_id, t.candidate): t.evaluation for t in history.trials}
    new = {key: row for row, key in enumerate(keys) if key not in known}  # twins only once
    if new:
        found = _evaluate(candidates[list(new.values())], evaluate)
        for key, evaluation in zip(new, found, strict=True):
            known[key] = _usable(evaluation, penalty)
    trials = zip(candidates, (known[key] for key in keys), strict=True)
    return tuple(Trial(candidate, evaluation) for candidate, evaluation in trials), len(new)


def _evaluate(
    candidates: NDArray[np.float64], evaluate: Evaluate
) -> Sequence[Evaluation | Exception]:
    """Evaluate all at once; where that raises, each alone to find whom it is due to."""
    try:
        return _complete(candidates, evaluate)
    except Exception as error:
        if not _may_be_a_candidate_s(error):
            raise
        first = error
    found = [_alone(candidate, evaluate) for candidate in candidates]
    if all(isinstance(one, Exception) for one in found):
        raise WorkbenchError(
            f"no candidate of a generation could be evaluated, the first for {_reason(first)}; "
            "the fault is in the objective, mend it and go on from the checkpoint"
        ) from first
    return found


def _alone(candidate: NDArray[np.float64], evaluate: Evaluate) -> Evaluation | Exception:
    try:
        return _complete(candidate[None], evaluate)[0]
    except Exception as error:
        if not _may_be_a_candidate_s(error):
            raise
        return error


def _may_be_a_candidate_s(error: Exception) -> bool:
    """Return False for a lost cluster or an interruption: no candidate causes them."""
    return isinstance(error, InputError) or not isinstance(error, WorkbenchError)


def _complete(candidates: NDArray[np.float64], evaluate: Evaluate) -> Sequence[Evaluation]:
    found = evaluate(candidates.copy())
    if len(found) != len(candidates):
        raise WorkbenchError(
            f"the objective gave {len(found)} evaluations of {len(candidates)} candidates"
        )
    return found


def _usable(found: Evaluation | Exception, penalty: tuple[float, ...]) -> Evaluation:
    """Return the evaluation, or a penalty for one that crashed or gave no number."""
    if isinstance(found, Exception):
        return Evaluation(penalty, failure=_reason(found))
    if len(found.fitness) != len(penalty):
        raise WorkbenchError(
            f"the objective gave {len(found.fitness)} goals where the search has {len(penalty)}"
        )
    if not all(map(math.isfinite, found.fitness)):
        goals = ", ".join(f"{goal:g}" for goal in found.fitness)
        return Evaluation(penalty, found.numbers, found.failure or f"fitness {goals}")
    fitness = tuple(float(goal) for goal in found.fitness)
    return Evaluation(fitness, found.numbers, found.failure)


def _reason(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
