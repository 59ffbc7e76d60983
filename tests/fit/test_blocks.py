"""Blocks of a Jacobian against the whole matrix."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.fit.blocks import Blocks

RNG = np.random.default_rng(3)
EDGES = (0, 7, 12, 15)
WHOLE = RNG.standard_normal((15, 6))
WHOLE[:7, 2] = WHOLE[7:12, 3] = WHOLE[12:, :4] = 0.0
"""The first two columns act in both runs, the next in one each, the last rows are priors."""


def test_products_are_those_of_the_whole_matrix() -> None:
    blocks = Blocks.of(WHOLE, EDGES)
    residuals, weights = RNG.standard_normal(15), RNG.uniform(0.5, 1, 15)
    gradient, curvature = blocks.normal(residuals, weights)
    assert blocks.dense() == pytest.approx(WHOLE, abs=0)
    assert gradient == pytest.approx(WHOLE.T @ (weights * residuals))
    assert curvature == pytest.approx(WHOLE.T @ (weights[:, None] * WHOLE))


def test_an_update_explains_the_step_and_keeps_the_zeros() -> None:
    step, change = RNG.standard_normal(6), RNG.standard_normal(15)
    after = Blocks.of(WHOLE, EDGES).updated(change, step)
    assert after.dense() @ step == pytest.approx(change)
    assert np.array_equal(after.dense() == 0, WHOLE == 0)


def test_a_block_that_a_step_does_not_touch_stays() -> None:
    alone = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])  # of the second block
    after = Blocks.of(WHOLE, EDGES).updated(np.ones(15), alone).dense()
    assert np.array_equal(after[:7], WHOLE[:7])
    assert not np.array_equal(after[7:12], WHOLE[7:12])


def test_without_edges_the_update_is_broyden_s() -> None:
    step, change = RNG.standard_normal(6), RNG.standard_normal(15)
    after = Blocks.of(WHOLE).updated(change, step).dense()
    wanted = WHOLE + np.outer(change - WHOLE @ step, step) / (step @ step)
    assert after == pytest.approx(wanted)
