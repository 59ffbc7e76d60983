"""The minimum between bounds, beside scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from tests.diagnose.paper import measured
from workbench.diagnose.layout import Layout
from workbench.diagnose.solve import Prior, step_from


@pytest.mark.parametrize("seed", range(20))
def test_a_step_ends_at_the_minimum_within_all_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = Layout(measured(seed))
    count = len(layout)
    layout.low[:] = -rng.uniform(0.0, 1.0, count) * rng.integers(0, 2, count)
    layout.high[:] = rng.uniform(0.0, 1.0, count)
    mixing = rng.normal(size=(count + 3, count)) * 10 ** rng.uniform(-2, 2, count)
    mixing[:, 1] = mixing[:, 0] * 1.1 + 0.01 * mixing[:, 1]  # two that look alike
    curvature, slope = mixing.T @ mixing, mixing.T @ rng.normal(size=count + 3) * 3
    prior = Prior(10 ** rng.uniform(-2, 2, count), np.arange(count))
    step = step_from(layout, np.zeros(count), curvature, slope, prior)
    root = cholesky(prior.added_to(curvature))
    wanted = solve_triangular(root, slope, trans=1)
    theirs = lsq_linear(root, wanted, (layout.low - 1e-12, layout.high + 1e-12), method="bvls").x
    assert np.any((step.z == layout.low) | (step.z == layout.high))
    assert np.all((step.z >= layout.low) & (step.z <= layout.high))
    off = np.linalg.norm(root @ step.z - wanted) - np.linalg.norm(root @ theirs - wanted)
    assert abs(off) < 1e-6 * np.linalg.norm(wanted)
