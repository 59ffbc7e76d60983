"""The search that learns: what it predicts, what it settles, how few evaluations it needs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.optimize.contract import START, beam
from workbench.errors import InputError
from workbench.optimize import Guided, GuidedOptions, Space
from workbench.optimize.surrogate import Surrogate, learn_scales

Points = NDArray[np.float64]


def cube(size: int = 8) -> Space:
    names = tuple(f"x{k}" for k in range(size))
    return Space(names, np.zeros(size), np.ones(size), np.full(size, 0.2))


def searched(algorithm: Guided, worth: object, generations: int) -> tuple[Points, Points]:
    """Return all candidates and what they were worth."""
    every: list[Points] = []
    for _ in range(generations):
        candidates = algorithm.ask()
        every.append(candidates)
        algorithm.tell(candidates, -worth(candidates))  # type: ignore[operator]
    whole = np.vstack(every)
    return whole, worth(whole)  # type: ignore[operator]


def folded(points: Points) -> Points:
    """Return two numbers of eight variables: what the worth below hangs on."""
    return np.column_stack([np.sin(3 * points).sum(axis=1), (points * points[:, ::-1]).sum(axis=1)])


def two_hills(points: Points) -> Points:
    """Return a broad hill of height 1 beside the start and a narrow one of height 2 far off."""
    a, b = folded(points).T
    broad = np.exp(-((a - 5.5) ** 2 + (b - 1.0) ** 2) / 4)
    return broad + 2 * np.exp(-((a - 2.2) ** 2 + (b - 5.2) ** 2) / 1.5)


def test_the_surrogate_predicts_what_it_was_not_told() -> None:
    draw = np.random.default_rng(0)
    told, asked = draw.uniform(-2, 2, (120, 3)), draw.uniform(-1.5, 1.5, (200, 3))

    def hill(z: Points) -> Points:
        return np.sin(2 * z[:, 0]) + z[:, 1] ** 2  # the third counts for nothing

    surrogate = Surrogate(told, hill(told), learn_scales(told, hill(told), ()))
    mean, deviation = surrogate.predict(asked)
    assert np.sqrt(np.mean((mean - hill(asked)) ** 2)) < 0.05 * hill(asked).std()
    unsure = surrogate.predict(np.full((1, 3), 9.0))[1]
    assert unsure[0] > 10 * deviation.max()
    together, covariance = surrogate.together(asked[:5])
    np.testing.assert_allclose(together, mean[:5])
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation[:5], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_both_hills_are_found(seed: int) -> None:
    algorithm = Guided(cube(), seed, folded)
    _, worth = searched(algorithm, two_hills, 16)
    assert worth.max() > 1.9


def test_descriptors_are_worth_more_than_variables() -> None:
    """The same search that learns over the variables finds less with as many evaluations."""
    told = [searched(Guided(cube(), seed, folded), two_hills, 10)[1].max() for seed in range(3)]
    blind = [searched(Guided(cube(), seed), two_hills, 10)[1].max() for seed in range(3)]
    assert np.median(told) > np.median(blind) + 0.3


def test_a_settled_region_is_left_by_half_of_each_generation() -> None:
    options = GuidedOptions(apart=1.0, patience=1, gain=0.5)
    algorithm = Guided(cube(), 1, folded, options=options)
    whole, worth = searched(algorithm, two_hills, 8)
    settled = algorithm.state()["settled"]
    assert settled
    described = folded(whole)
    spread = described[:36].std(axis=0)
    centre = described[settled[0]]
    last = np.linalg.norm((folded(algorithm.ask()) - centre) / spread, axis=1)
    assert np.all(last[6:] > 1.0)
    assert whole[settled[0]].tolist() in whole[worth > np.median(worth)].tolist()


def test_what_is_not_possible_is_never_asked_for() -> None:
    def possible(candidate: Points) -> bool:
        return bool(candidate[0] < 0.5)

    whole, _ = searched(Guided(cube(), 0, folded, possible), two_hills, 8)
    assert np.all(whole[:, 0] < 0.5)


def test_what_cannot_be_described_is_never_asked_for() -> None:
    def describe(points: Points) -> Points:
        described = folded(points)
        described[points[:, 0] > 0.5] = np.nan
        return described

    whole, _ = searched(Guided(cube(), 0, describe), two_hills, 8)
    assert np.all(whole[:, 0] <= 0.5)


def test_failures_neither_blind_nor_attract_it() -> None:
    """Penalties a hundred times as bad as all else leave the hills to be found."""

    def with_falls(points: Points) -> Points:
        return np.where(points[:, 3] > 0.7, -100.0, two_hills(points))

    whole, worth = searched(Guided(cube(), 0, folded), with_falls, 16)
    assert worth.max() > 1.5
    assert np.mean(whole[-48:, 3] > 0.7) < 0.3


def test_the_first_candidates_are_far_apart_and_begin_with_the_start() -> None:
    first = Guided(beam(), 0).ask()
    assert np.array_equal(first[0], START)
    apart = np.linalg.norm(first[:, None] - first[None], axis=2)
    drawn = beam().sample(np.random.default_rng(0), 12)
    at_random = np.linalg.norm(drawn[:, None] - drawn[None], axis=2)
    pairs = np.triu_indices(12, 1)
    assert apart[pairs].min() > 1.2 * at_random[pairs].min()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"population_size": 9}, "population size 9 is not even and at least 2"),
        ({"first": 0}, "first 0 and patience 2 are at least 1"),
        ({"patience": 0}, "patience 0 are at least 1"),
        ({"gain": -1.0}, "gain -1 and apart 2.5 at least 0"),
    ],
)
def test_options_without_a_search_are_refused(options: dict[str, float], told: str) -> None:
    with pytest.raises(InputError, match=told):
        GuidedOptions(**options)  # pyright: ignore[reportArgumentType]
