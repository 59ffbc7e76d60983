"""CMA-ES in mirrored pairs: what it draws, what it learns from, where it starts again."""

from __future__ import annotations

import numpy as np
import pytest

from tests.optimize.contract import START, beam
from workbench.errors import InputError
from workbench.optimize import Cmaes, CmaesOptions, Space


def open_space(size: int = 8) -> Space:
    """Return a space so wide that nothing is projected."""
    names = tuple(f"x{k}" for k in range(size))
    return Space(names, np.full(size, -50.0), np.full(size, 50.0), np.zeros(size))


def test_samples_come_in_pairs_about_the_mean() -> None:
    algorithm = Cmaes(open_space(), 0)
    candidates = algorithm.ask()
    np.testing.assert_allclose(candidates[2::2], -candidates[3::2], atol=1e-12)
    assert np.array_equal(candidates[0], np.zeros(8))


def test_the_first_samples_spread_as_sigma_says() -> None:
    options = CmaesOptions(population_size=2000, sigma=0.02)
    candidates = Cmaes(open_space(), 0, options).ask()
    np.testing.assert_allclose(candidates.std(axis=0), 0.02 * 100, rtol=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_an_ill_conditioned_bowl_is_solved(seed: int) -> None:
    algorithm = Cmaes(open_space(), seed, CmaesOptions(population_size=10, sigma=0.05))
    scale, target = np.logspace(0, 3, 8), np.full(8, 3.0)
    for _ in range(600):
        candidates = algorithm.ask()
        algorithm.tell(candidates, ((candidates - target) ** 2 * scale).sum(axis=1))
    np.testing.assert_allclose(algorithm.state()["best"], target, atol=1e-3)


def test_only_ranks_count() -> None:
    def told(stretch: float) -> np.ndarray:
        algorithm = Cmaes(beam(), 0)
        for _ in range(20):
            candidates = algorithm.ask()
            algorithm.tell(candidates, np.exp(stretch * candidates[:, 5]))
        return algorithm.ask()

    assert np.array_equal(told(1.0), told(7.0))


def test_of_equal_failures_the_farther_is_the_worse() -> None:
    """In which order failures are told does not matter, their distance does."""

    def after(order: slice) -> np.ndarray:
        algorithm = Cmaes(open_space(), 0)
        candidates = algorithm.ask().reshape(4, 2, 8)[order].reshape(8, 8)
        algorithm.tell(candidates, np.full(8, 102.0))
        return algorithm.ask()

    assert np.array_equal(after(slice(None)), after(slice(None, None, -1)))


def test_a_stalled_search_starts_again_around_the_best() -> None:
    algorithm = Cmaes(open_space(), 0, CmaesOptions(patience=3, sigma=0.1, shrink=0.5))
    candidates = algorithm.ask()
    algorithm.tell(candidates, np.arange(8.0))
    for _ in range(3):
        algorithm.tell(algorithm.ask(), np.arange(8.0) + 1)
    state = algorithm.state()
    assert state["begun_at"] == candidates[0].tolist()
    assert (state["sigma"], state["told"], state["stalled"]) == (0.05, [], 0)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"population_size": 9}, "population size 9 is not even and at least 4"),
        ({"population_size": 2}, "population size 2 is not even and at least 4"),
        ({"sigma": 0.0}, "sigma 0 is above 0"),
        ({"patience": 0}, "patience 0 at least 1"),
        ({"shrink": 1.5}, "shrink 1.5 above 0 and at most 1"),
    ],
)
def test_options_without_a_search_are_refused(options: dict[str, float], told: str) -> None:
    with pytest.raises(InputError, match=told):
        CmaesOptions(**options)  # pyright: ignore[reportArgumentType]


def test_the_start_is_the_first_candidate() -> None:
    assert np.array_equal(Cmaes(beam(), 4).ask()[0], START)
