"""The loop: whom a crash is due to, what is evaluated again, and that a search gets better."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.optimize.contract import ALGORITHMS, NAMES, START, beam, facts, ridges
from tests.optimize.searches import SEARCHES
from workbench.errors import InputError, Interrupted, WorkbenchError
from workbench.optimize import (
    Cmaes,
    Evaluation,
    GeneticAlgorithm,
    History,
    Pareto,
    candidate_key,
    search,
)

PENALTY = (102.0,)
FIRST = 25  # evaluations in which another seed shows


def bowl(candidates: NDArray[np.float64]) -> list[Evaluation]:
    return [Evaluation((float(np.sum((c + 0.1) ** 2)),)) for c in candidates]


@pytest.mark.parametrize(("name", "evaluations"), SEARCHES)
def test_a_search_gets_better_and_repeats_itself(name: str, evaluations: int) -> None:
    def run(seed: int, evaluations: int = evaluations) -> History:
        algorithm = ALGORITHMS[name](beam(), seed)
        goals = algorithm.goals
        return search(
            "ridges", algorithm, ridges(goals), evaluations=evaluations, penalty=PENALTY * goals
        )

    history = run(7)
    assert history.best.evaluation.fitness < history.generations[0].trials[0].evaluation.fitness
    assert facts(history) == facts(run(7))
    begun = facts(run(8, FIRST))
    assert begun != facts(history)[: len(begun)]
    assert np.array_equal(history.trials[0].candidate, START)


def test_the_evaluations_are_not_exceeded_and_generations_are_whole() -> None:
    history = search("bowl", GeneticAlgorithm(beam(), 0), bowl, evaluations=40, penalty=PENALTY)
    assert [len(g.trials) for g in history.generations] == [12, 12, 12]
    assert history.asked == 36


def test_elites_count_but_are_not_evaluated_again() -> None:
    seen: list[bytes] = []

    def evaluate(candidates: NDArray[np.float64]) -> list[Evaluation]:
        seen.extend(c.tobytes() for c in candidates)
        return bowl(candidates)

    history = search(
        "bowl", GeneticAlgorithm(beam(), 0), evaluate, evaluations=240, penalty=PENALTY
    )
    assert len(seen) == len(set(seen)) == history.evaluated
    assert history.asked == 240
    assert history.evaluated <= 240 - 19


def test_a_candidate_that_crashes_is_a_penalty_with_its_reason() -> None:
    history = search("r", Cmaes(beam(), 3), ridges(), evaluations=240, penalty=PENALTY)
    reasons = [reason for g in history.generations for reason in g.failures]
    crashed = [reason for reason in reasons if reason.startswith("FloatingPointError: blew up at")]
    assert crashed
    assert {t.evaluation.fitness for t in history.trials if t.evaluation.failure} == {PENALTY}
    assert set(reasons) - set(crashed) <= {"fell after 3 s"}


def test_a_robot_that_cannot_stand_is_a_candidate_s_fault() -> None:
    def evaluate(candidates: NDArray[np.float64]) -> list[Evaluation]:
        if np.any(candidates[:, 1] > 0.2):
            raise InputError("this robot does not stand")
        return bowl(candidates)

    history = search("b", Cmaes(beam(), 0), evaluate, evaluations=80, penalty=PENALTY)
    failed = [t for t in history.trials if t.evaluation.failure]
    assert failed
    assert all(t.candidate[1] > 0.2 for t in failed)
    assert failed[0].evaluation.failure == "InputError: this robot does not stand"


def test_a_fitness_that_is_no_number_is_a_penalty() -> None:
    def evaluate(candidates: NDArray[np.float64]) -> list[Evaluation]:
        return [Evaluation((float("nan") if c[1] > 0.2 else 1.0,), {"x": 2.0}) for c in candidates]

    history = search("b", Cmaes(beam(), 0), evaluate, evaluations=16, penalty=PENALTY)
    failed = [t.evaluation for t in history.trials if t.evaluation.failure]
    assert failed[0] == Evaluation(PENALTY, {"x": 2.0}, "fitness nan")


def test_an_objective_that_always_raises_ends_the_search() -> None:
    def evaluate(_: NDArray[np.float64]) -> list[Evaluation]:
        raise KeyError("omega")

    with pytest.raises(WorkbenchError, match=r"first for KeyError: 'omega'; .* the checkpoint"):
        search("b", Cmaes(beam(), 0), evaluate, evaluations=16, penalty=PENALTY)


@pytest.mark.parametrize("error", [WorkbenchError("no worker"), Interrupted("stopped")])
def test_a_lost_cluster_and_a_user_end_the_search(error: WorkbenchError) -> None:
    calls = 0

    def evaluate(_: NDArray[np.float64]) -> list[Evaluation]:
        nonlocal calls
        calls += 1
        raise error

    with pytest.raises(type(error), match=str(error)):
        search("b", Cmaes(beam(), 0), evaluate, evaluations=16, penalty=PENALTY)
    assert calls == 1


@pytest.mark.parametrize(
    ("found", "told"),
    [
        ([], "gave 0 evaluations of 8 candidates"),
        ([Evaluation((1.0, 2.0))] * 8, "gave 2 goals where the search has 1"),
    ],
)
def test_an_objective_that_answers_otherwise_is_refused(
    found: Sequence[Evaluation], told: str
) -> None:
    with pytest.raises(WorkbenchError, match=told):
        search("b", Cmaes(beam(), 0), lambda _: found, evaluations=8, penalty=PENALTY)


def test_a_penalty_has_a_number_for_each_goal() -> None:
    with pytest.raises(InputError, match="nsga2 takes 2 goals, the penalty has 1"):
        search("b", Pareto(beam(), 0), bowl, evaluations=8, penalty=PENALTY)


def test_progress_is_told_of_every_generation_and_may_end_the_search() -> None:
    told: list[tuple[int, int]] = []

    def progress(history: History, total: int) -> None:
        told.append((history.asked, total))
        if history.asked == 24:
            raise Interrupted("enough")

    with pytest.raises(Interrupted, match="enough"):
        search("b", Cmaes(beam(), 0), bowl, evaluations=80, penalty=PENALTY, watch=progress)
    assert told == [(8, 80), (16, 80), (24, 80)]


def test_a_candidate_s_key_is_that_of_its_problem_and_its_bits() -> None:
    point = np.array(START)
    assert candidate_key("a", point) == candidate_key("a", point.copy())
    assert candidate_key("a", point) != candidate_key("b", point)
    assert candidate_key("a", point) != candidate_key("a", np.nextafter(point, 0.0))


def test_the_best_of_nothing_is_an_error() -> None:
    with pytest.raises(WorkbenchError, match="no generation yet; give it more evaluations"):
        _ = History(NAMES).best


def test_cma_turns_back_from_where_all_fail() -> None:
    def cliff(candidates: NDArray[np.float64]) -> list[Evaluation]:
        start = np.array(START)
        near = np.linalg.norm(candidates - start, axis=1) < 0.15
        far = [float(x) for x in 2 - candidates[:, 5]]
        return [
            Evaluation((f,)) if n else Evaluation(PENALTY, failure="fell")
            for n, f in zip(near, far, strict=True)
        ]

    last = []
    for seed in range(8):  # one search alone may fall off once more at its end
        history = search("c", Cmaes(beam(), seed), cliff, evaluations=480, penalty=PENALTY)
        failures = history.columns()["failures"]
        assert failures[1:6].min() >= 6  # nearly all of 8
        assert history.best.candidate[5] > START[5] + 0.1
        last.append(failures[-10:].mean())
    assert np.mean(last) <= 3.5  # the best is on the edge, where half of them fall
