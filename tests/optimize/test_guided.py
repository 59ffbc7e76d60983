"""The search that learns: what it predicts, which niches it tries, how few evaluations it needs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.optimize.contract import START, beam
from workbench.errors import InputError
from workbench.optimize import Guided, GuidedOptions, Space
from workbench.optimize.niches import Niches
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


def anything(described: Points) -> NDArray[np.bool_]:
    return np.ones(len(described), dtype=bool)


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


def test_a_long_search_predicts_from_what_is_near_its_centres(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As well as from all of it, and its effort does not grow with it."""
    sizes: list[int] = []

    class Sized(Surrogate):
        def __init__(self, described: Points, scores: Points, scales: list[float]) -> None:
            sizes.append(len(described))
            super().__init__(described, scores, scales)

    monkeypatch.setattr("workbench.optimize.guided._PREDICTED_FROM", 60)
    monkeypatch.setattr("workbench.optimize.guided.Surrogate", Sized)
    _, worth = searched(Guided(cube(), 0, folded), two_hills, 16)
    assert sizes == [36, 48, *11 * [60]]
    assert worth.max() > 1.9


def test_descriptors_are_worth_more_than_variables() -> None:
    """The same search that learns over the variables finds less with as many evaluations."""
    told = [searched(Guided(cube(), seed, folded), two_hills, 10)[1].max() for seed in range(3)]
    blind = [searched(Guided(cube(), seed), two_hills, 10)[1].max() for seed in range(3)]
    assert np.median(told) > np.median(blind) + 0.3


def test_what_was_searched_well_gives_way_to_what_was_not() -> None:
    """Without curiosity a search stays around its best, with much of it it goes elsewhere too."""

    def far_apart(curiosity: float) -> float:
        options = GuidedOptions(first=1, curiosity=curiosity)
        whole, worth = searched(Guided(cube(), 1, folded, options=options), two_hills, 12)
        best = folded(whole)[np.argmax(worth)]
        return float(np.mean(np.linalg.norm(folded(whole[-60:]) - best, axis=1) > 1.0))

    assert far_apart(0.0) < far_apart(3.0) - 0.2


def test_a_generation_is_as_large_as_it_is_said_to_be() -> None:
    for size in (1, 2, 3):
        algorithm = Guided(cube(), 0, folded, options=GuidedOptions(population_size=size))
        whole, _ = searched(algorithm, two_hills, 5)
        assert len(whole) == 5 * size


def test_niches_hold_rare_kinds_too() -> None:
    """Of points drawn at random few are described by high numbers; of the niches' points many."""

    def rare(points: Points) -> Points:
        return points[:, :2] ** 8

    niches = Niches(cube(), rare, anything, 6, np.random.default_rng(0))
    drawn = rare(cube().sample(np.random.default_rng(0), 600))
    corner = np.mean(np.all(rare(niches.points) > 0.5, axis=1))
    assert corner > 5 * np.mean(np.all(drawn > 0.5, axis=1))
    assert sorted(np.concatenate([niches.members(k) for k in range(6)])) == list(
        range(len(niches.points))
    )
    assert niches.points[0].tolist() == cube().start.tolist()


def test_niches_are_of_what_is_likely_where_there_is_any() -> None:
    draw = np.random.default_rng(0)
    high = Niches(cube(), folded, lambda one: one[:, 0] > 6.0, 4, draw)
    assert np.all(folded(high.points[1:])[:, 0] > 6.0)
    none = Niches(cube(), folded, lambda one: one[:, 0] > 99.0, 4, draw)
    assert len(none.points) > 500


def test_a_space_without_anything_to_describe_still_gives_a_generation() -> None:
    """What it holds is then found out by evaluating, and told by the search's own error."""
    algorithm = Guided(cube(), 0, lambda points: np.full((len(points), 2), np.nan))
    assert algorithm.ask().tolist() == [cube().start.tolist()] * 12


def test_scales_that_were_learnt_badly_are_left() -> None:
    """A process that took everything for noise finds its way back."""
    draw = np.random.default_rng(0)
    told = draw.uniform(-2, 2, (80, 2))
    worth = np.sin(2 * told[:, 0])
    noise_alone = [np.log(1e-2), np.log(30.0), np.log(30.0), np.log(0.5)]
    assert learn_scales(told, worth, noise_alone)[-1] < np.log(1e-3)


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
        ({"population_size": 0}, "population size 0, first 3 and niches 8 are at least 1"),
        ({"first": 0}, "first 0 and niches 8 are at least 1"),
        ({"niches": 0}, "niches 0 are at least 1"),
        ({"curiosity": -1.0}, "curiosity -1 at least 0"),
    ],
)
def test_options_without_a_search_are_refused(options: dict[str, float], told: str) -> None:
    with pytest.raises(InputError, match=told):
        GuidedOptions(**options)  # pyright: ignore[reportArgumentType]
