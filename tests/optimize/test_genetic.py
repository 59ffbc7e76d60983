"""The operators of the genetic algorithm do what MATLAB documents."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.optimize.contract import ALGORITHMS, START, beam
from tests.optimize.searches import GUIDED
from workbench.errors import InputError
from workbench.optimize import GeneticAlgorithm, GeneticOptions
from workbench.optimize.genetic import expectation, roulette, scattered

SEEDS = st.integers(0, 2**31)
OTHERS = sorted(set(ALGORITHMS) - set(GUIDED))
FITNESS = st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=20)


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(OTHERS), SEEDS, SEEDS)
def test_every_candidate_of_every_generation_is_inside(name: str, seed: int, luck: int) -> None:
    stays_inside(name, seed, luck)


@pytest.mark.parametrize("name", GUIDED)
def test_so_is_every_candidate_of_a_guided_search(name: str) -> None:
    stays_inside(name, 1, 2)


@pytest.mark.long
@settings(deadline=None, max_examples=20)
@given(st.sampled_from(GUIDED), SEEDS, SEEDS)
def test_so_is_every_candidate_of_many_guided_searches(name: str, seed: int, luck: int) -> None:
    stays_inside(name, seed, luck)


def stays_inside(name: str, seed: int, luck: int) -> None:
    """Run six generations whose fitness is drawn."""
    space = beam()
    algorithm = ALGORITHMS[name](space, seed)
    generator = np.random.default_rng(luck)
    for _ in range(6):
        candidates = algorithm.ask()
        assert candidates.shape[1] == len(space)
        assert space.contains(candidates).all()
        shape = (len(candidates), algorithm.goals) if algorithm.goals > 1 else len(candidates)
        algorithm.tell(candidates, generator.choice([0.5, 2.0, 102.0], shape))


@given(FITNESS)
def test_shift_linear_is_linear_and_never_negative(fitness: list[float]) -> None:
    worth = expectation(np.array(fitness), 2.0)
    assert (worth >= 0).all()
    assert worth.mean() == pytest.approx(1.0)
    assert worth.max() <= 2.0 + 1e-9


def test_the_best_is_due_the_survival_rate_times_the_mean() -> None:
    np.testing.assert_allclose(expectation(np.array([1.0, 2.0, 3.0]), 2.0), [2.0, 1.0, 0.0])
    np.testing.assert_allclose(expectation(np.array([0.0, 3.0, 3.0]), 1.5), [1.5, 0.75, 0.75])


def test_where_the_worst_would_be_due_less_than_nothing_the_line_is_flatter() -> None:
    # mean 36.25: the one that fell is due nothing, the others share its part
    worth = expectation(np.array([14.0, 14.0, 15.0, 102.0]), 2.0)
    assert worth[3] == 0.0
    np.testing.assert_allclose(worth[:3], 1 + (36.25 - np.array([14, 14, 15])) / 65.75)


def test_equal_fitness_is_due_the_same() -> None:
    assert expectation(np.full(5, 102.0), 2.0).tolist() == [1.0] * 5


def test_the_roulette_s_wheel_has_sections_of_the_worth() -> None:
    drawn = roulette(np.random.default_rng(0), np.array([2.0, 1.0, 0.0, 1.0]), 40_000)
    np.testing.assert_allclose(
        np.bincount(drawn, minlength=4) / 40_000, [0.5, 0.25, 0, 0.25], atol=0.01
    )


def test_a_scattered_child_takes_each_variable_from_one_parent() -> None:
    first, second = np.zeros((2000, 16)), np.ones((2000, 16))
    children = scattered(np.random.default_rng(0), first, second)
    assert set(np.unique(children)) == {0.0, 1.0}
    np.testing.assert_allclose(children.mean(axis=0), 0.5, atol=0.05)
    assert len(np.unique(children, axis=0)) > 1900


def test_a_generation_is_the_elite_then_crossover_then_mutation() -> None:
    space = beam()
    algorithm = GeneticAlgorithm(space, 0)
    parents = algorithm.ask()
    assert np.array_equal(parents[0], START)
    fitness = np.arange(12.0)[::-1].copy()
    algorithm.tell(parents, fitness)
    children = algorithm.ask()
    assert np.array_equal(children[0], parents[11])
    from_a_parent = (children[:, None, :] == parents).any(axis=1)
    assert from_a_parent[1:7].all()  # round(0.5 * 11) crossover children, inside as their parents
    assert (from_a_parent[7:].mean(axis=1) < 1).all()  # and five mutants


def test_gaussian_mutation_shrinks_to_nothing_at_the_last_generation() -> None:
    options = GeneticOptions(
        mutation_fcn="mutationgaussian",
        scale=0.01,
        generations=4,
        crossover_fraction=0.0,
        population_size=200,
    )
    space = beam()
    algorithm = GeneticAlgorithm(space, 0, options)
    spread = []
    for _ in range(5):
        candidates = algorithm.ask()
        spread.append(np.std((candidates[1:] - START)[:, 11] / space.widths[11]))
        algorithm.tell(np.tile(START, (200, 1)), np.ones(200))
    np.testing.assert_allclose(spread, [0.01, 0.0075, 0.005, 0.0025, 0.0], rtol=0.15)


def test_the_adaptive_step_follows_success() -> None:
    algorithm = GeneticAlgorithm(beam(), 0)
    steps = []
    for best in (5.0, 5.0, 5.0, 4.0, 4.0):
        algorithm.tell(algorithm.ask(), np.full(12, best))
        steps.append(algorithm.state()["step"])
    assert steps == [1.0, 0.5, 0.25, 0.5, 0.25]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"elite_count": 12}, "elite count 12 leaves no children in a population of 12"),
        ({"crossover_fraction": 1.2}, "crossover fraction 1.2 is not 0 to 1"),
        ({"max_survival_rate": 1.0}, "max survival rate 1 is not above 1"),
        ({"shrink": -0.1}, "shrink -0.1 is 0 to 1"),
    ],
)
def test_options_without_a_search_are_refused(options: dict[str, float], told: str) -> None:
    with pytest.raises(InputError, match=told):
        GeneticOptions(**options)  # pyright: ignore[reportArgumentType]
