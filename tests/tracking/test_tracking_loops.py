"""The compiled loops against numpy and scipy."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.tracking import loops


@pytest.mark.parametrize("count", [4, 5, 6, 7, 8, 60])
@pytest.mark.parametrize("penalty", [0.1, 1e4])
def test_the_curve_solves_its_equations(count: int, penalty: float) -> None:
    rng = np.random.default_rng(count)
    values, seen = rng.normal(size=(3, count)), np.ones(count, dtype=np.bool_)
    seen[4:-2:3] = False
    thirds = np.diff(np.eye(count), 3, axis=0)
    equations = np.diag(seen.astype(float)) + penalty * thirds.T @ thirds
    expected = np.linalg.solve(equations, np.where(seen, values, 0.0).T).T
    values[:, ~seen] = np.nan  # is ignored
    np.testing.assert_allclose(loops.smooth(values, seen, penalty), expected, atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 5, 40])
def test_running_medians_are_those_of_a_sort(count: int) -> None:
    values = np.random.default_rng(count).normal(size=(2, count)).round(1)  # some are equal
    padded = np.pad(values, ((0, 0), (2, 2)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 5, axis=1)
    np.testing.assert_array_equal(loops.median_of_five(values), np.median(windows, axis=2))


def test_a_marker_that_is_not_seen_may_have_moved() -> None:
    cloud = np.zeros((2, 3, 6))
    cloud[1, 2, 2:] = 0.01
    cloud[0, 1, 4] = np.nan
    assert loops.steady(cloud, 0.02).tolist() == [False, True, True, True, False, False]
    assert loops.steady(cloud, 0.005).tolist() == [False, True, False, True, False, False]
    assert loops.whole(cloud).tolist() == [True, True, True, True, False, True]
    both = np.ones(2, dtype=np.bool_)
    assert loops.visible(cloud, both).tolist() == [3, 3, 3, 3, 2, 3]
    assert loops.visible(cloud, np.array([True, False])).tolist() == [1, 1, 1, 1, 0, 1]
