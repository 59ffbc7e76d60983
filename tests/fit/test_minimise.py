"""The minimiser on small problems whose minima are known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.fit import minimum

Array = NDArray[np.float64]
OPEN = (np.full(2, -np.inf), np.full(2, np.inf))


def valley(x: Array) -> Array:
    """Rosenbrock's, its minimum at one, scaled so that it is many standard errors deep."""
    return 100 * np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def slopes(x: Array) -> Array:
    return 100 * np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])


@pytest.mark.parametrize("start", [(-1.2, 1.0), (1e-4, 1e-4), (0.0, 0.0)])
def test_a_curved_valley_is_followed_from_any_start(start: tuple[float, float]) -> None:
    found = minimum(valley, slopes, np.array(start), OPEN, 1e6, 100)
    assert found.converged
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-2)


def test_a_bound_holds_a_number_and_the_other_goes_on() -> None:
    bounds = (np.array([-2.0, -2.0]), np.array([0.5, 2.0]))
    found = minimum(valley, slopes, np.array([0.0, 0.0]), bounds, 1e6, 100)
    assert found.converged
    assert found.x == pytest.approx([0.5, 0.25], abs=1e-2)


def test_a_number_that_nothing_depends_on_stays() -> None:
    found = minimum(
        lambda x: np.array([10 * x[0]]), lambda x: np.array([[10.0, 0.0]]),
        np.array([1.0, 0.7]), OPEN, 1e6, 20,
    )  # fmt: skip
    assert found.x == pytest.approx([0.0, 0.7], abs=0.05)


def test_wild_data_pull_a_number_no_farther_than_its_prior_lets_them() -> None:
    """One sample 100 sigma off, c = 4: its pull is 2 c = 8, that of the prior 2 x."""
    found = minimum(
        lambda x: np.array([100 - x[0], x[0]]), lambda x: np.array([[-1.0], [1.0]]), np.zeros(1),
        (np.full(1, -np.inf), np.full(1, np.inf)), np.array([4.0, np.inf]), 20, 1e-6,
    )  # fmt: skip
    assert found.converged
    assert found.x == pytest.approx([4.0], abs=0.02)
    assert found.cost == pytest.approx(8 * 96 - 32 + 16, abs=2)


def test_a_jacobian_is_asked_for_seldom_where_residuals_are_almost_straight() -> None:
    asked = []

    def rough(x: Array) -> Array:
        asked.append(x)
        return np.array([[9.0, 1.0], [0.0, 11.0]])

    target = np.array([3.0, -2.0])
    found = minimum(lambda x: 10 * (x - target), rough, np.zeros(2), OPEN, 1e6, 30)
    assert found.converged
    assert found.x == pytest.approx(target, abs=0.05)
    assert len(asked) <= 2


def test_a_kink_that_no_shorter_step_passes_ends_the_search() -> None:
    count = []

    def kinked(x: Array) -> Array:
        count.append(x)
        return np.array([5.0, 5.0]) if len(count) == 1 else np.array([6.0, 6.0])

    found = minimum(kinked, lambda x: np.eye(2), np.zeros(2), OPEN, 1e6, 30)
    assert not found.converged
    assert found.x.tolist() == [0.0, 0.0]
    assert len(count) == 3
