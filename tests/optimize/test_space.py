"""The space is what it says, to the last bit, and projection gives the nearest point."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import LinearConstraint, minimize

from tests.optimize.contract import NAMES, beam
from workbench.errors import InputError
from workbench.optimize import Space

ANGLES = st.lists(st.floats(-9, 9), min_size=16, max_size=16)


def space_of(**changes: object) -> Space:
    given_values: dict[str, object] = {
        "names": ("a", "b"),
        "lower": np.zeros(2),
        "upper": np.ones(2),
        "start": np.array([0.5, 0.5]),
    }
    return Space(**(given_values | changes))  # pyright: ignore[reportArgumentType]


@given(ANGLES)
def test_a_projection_is_inside_in_whatever_order_it_is_added_up(angles: list[float]) -> None:
    space = beam()
    inside = space.project(np.array(angles))
    assert space.contains(inside)
    summed = inside[1:].tolist()
    orders = (summed, summed[::-1], sorted(summed), sorted(summed, reverse=True))
    for total in (*map(sum, orders), math.fsum(summed), float(np.sum(summed))):
        assert -0.1 <= total <= 1.2 * math.pi


@given(ANGLES)
def test_a_projection_stays_where_it_is(angles: list[float]) -> None:
    inside = beam().project(np.array(angles))
    assert np.array_equal(beam().project(inside), inside)


@given(st.integers(0, 10**6))
def test_what_is_inside_is_not_touched(seed: int) -> None:
    points = beam().sample(np.random.default_rng(seed), 3)
    assert np.array_equal(beam().project(points), points)


@pytest.mark.parametrize("seed", range(8))
def test_no_point_inside_is_nearer_than_the_projection(seed: int) -> None:
    space, generator = beam(), np.random.default_rng(seed)
    point = generator.uniform(-3, 3, 16)
    nearest = space.project(point)

    def distance(x: NDArray[np.float64]) -> float:
        return float(np.sum((x - point) ** 2))

    found = minimize(
        distance,
        space.start,
        jac=lambda x: 2 * (x - point),
        bounds=list(zip(space.lower, space.upper, strict=True)),
        constraints=LinearConstraint(space.in_sum.astype(float), -0.1, 1.2 * np.pi),
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert distance(nearest) <= found.fun + 1e-9
    np.testing.assert_allclose(nearest, found.x, atol=1e-5)


def test_a_known_projection_in_two_variables() -> None:
    space = space_of(summed=("a", "b"), sum_upper=1.0)
    np.testing.assert_allclose(space.project(np.array([1.0, 0.8])), [0.6, 0.4], atol=1e-14)
    np.testing.assert_allclose(space.project(np.array([3.0, 0.1])), [1.0, 0.0], atol=1e-14)


def test_a_variable_outside_the_sum_is_only_clipped() -> None:
    far = np.full(16, 5.0)
    assert beam().project(far)[0] == -1.0


def test_samples_fill_the_set_evenly() -> None:
    space = space_of(start=np.array([0.2, 0.2]), summed=("a", "b"), sum_upper=1.0)
    drawn = space.sample(np.random.default_rng(0), 20_000)
    assert space.contains(drawn).all()
    # an even triangle has its centre at a third
    np.testing.assert_allclose(drawn.mean(axis=0), 1 / 3, atol=0.01)


def test_a_thin_slice_is_sampled_by_projection() -> None:
    space = space_of(summed=("a", "b"), sum_lower=1.0 - 1e-9, sum_upper=1.0 + 1e-9)
    drawn = space.sample(np.random.default_rng(0), 50)
    assert space.contains(drawn).all()
    assert np.ptp(drawn[:, 0]) > 0.5


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"start": np.zeros(3)}, r"start has shape \(3,\); 2 variables need \(2,\)"),
        ({"names": ("a", "a")}, "named twice in a, a"),
        ({"summed": ("c",)}, "takes c, which is no variable of a, b"),
        ({"lower": np.array([0.0, 1.0])}, "variable b: lower 1 and upper 1 leave nothing"),
        ({"upper": np.array([np.inf, 1.0])}, "variable a: lower 0 and upper inf"),
        ({"start": np.array([0.5, 1.5])}, "variable b: the start 1.5 is outside 0 to 1"),
        ({"summed": ("a", "b"), "sum_lower": 3.0}, "sum of a, b can be 0 to 2 .* 3 to inf is ask"),
        ({"summed": ("a", "b"), "sum_upper": 0.5}, "start's sum of a, b is 1, outside -inf to 0.5"),
    ],
)
def test_a_space_that_cannot_be_searched_is_refused(changes: dict[str, object], told: str) -> None:
    with pytest.raises(InputError, match=told):
        space_of(**changes)


def test_long_sums_are_named_short() -> None:
    with pytest.raises(InputError, match=r"sum of alpha_0 \.\.\. alpha_15 can be"):
        Space(NAMES, np.zeros(16), np.ones(16), np.zeros(16), summed=NAMES, sum_lower=20.0)


def test_the_space_keeps_its_own_numbers() -> None:
    lower = np.zeros(2)
    space = space_of(lower=lower)
    lower[0] = 9.0
    assert space.lower[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        space.start[0] = 1.0


def test_projection_takes_any_number_of_points_at_once() -> None:
    points = np.random.default_rng(0).uniform(-2, 2, (4, 5, 16))
    at_once = beam().project(points)
    for i, j in itertools.product(range(4), range(5)):
        assert np.array_equal(at_once[i, j], beam().project(points[i, j]))
