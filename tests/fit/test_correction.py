"""The compiled correction against Kalman's formulas, written with matrices."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.fit.correction import correct


@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("late", [0.0, 0.2])
@pytest.mark.parametrize("missing", [(), (1,)])
def test_places_joints_and_rates_correct_the_state_as_kalman_says(missing, late, noisy):
    rng = np.random.default_rng(5)
    channels, dofs, modes = 3, 4, 2
    seen, bias = rng.normal(size=(2, channels))
    seen[list(missing)] = np.nan
    points, jacobian = rng.normal(size=(1, 3)), rng.normal(size=(3, dofs))
    mix = rng.normal(size=(channels, 3))
    pick, pick_rate = rng.normal(size=(2, channels, dofs))
    basis, noise = rng.normal(size=(dofs, modes)), rng.uniform(0.5, 1, channels)
    width = 2 * modes + (channels if noisy else 0)
    root = rng.normal(size=(width, width))
    memory, expected = np.array([0.8, 0.3, 0.0]), rng.normal(size=channels) if noisy else 0.0
    coloured = np.array([expected + np.zeros(channels)])
    covariance = root @ root.T
    qpos, qvel = rng.normal(size=(2, dofs))
    at, rates, delay = qpos.copy(), qvel.copy(), np.array([0.0, 0.0, late])
    innovation, white = np.empty((2, 1, channels))
    information, slopes = np.empty(1), np.empty((1, channels, modes))
    correct(
        seen[None], np.full((1, channels), np.inf), np.zeros((1, channels), dtype=np.int64),
        points[None], jacobian[None], mix[None], pick[None], pick_rate[None],
        bias[None], delay[None], basis[None], covariance[None], noise[None],
        memory[None], coloured, np.zeros(0, dtype=np.int64), qpos[None], qvel[None],
        np.zeros((1, 0)), innovation, white, information, slopes,
    )  # fmt: skip

    kept = [c for c in range(channels) if c not in missing]
    slope = mix @ jacobian + pick
    rate = pick_rate - delay[:, None] * slope
    h = np.hstack([slope @ basis, rate @ basis, *([np.eye(channels)] if noisy else [])])[kept]
    error = (seen - mix @ points[0] - pick @ at - rate @ rates - bias - expected)[kept]
    spread = h @ covariance @ h.T + np.diag(noise[kept])
    change = covariance @ h.T @ np.linalg.solve(spread, error)
    assert innovation[0, kept] == pytest.approx(error)
    assert qpos == pytest.approx(at + basis @ change[:modes])
    assert qvel == pytest.approx(rates + basis @ change[modes : 2 * modes])
    if noisy:
        assert coloured[0] == pytest.approx(memory * (expected + change[2 * modes :]))
    assert white[0] @ white[0] == pytest.approx(error @ np.linalg.solve(spread, error))
    assert information[0] == pytest.approx(np.linalg.slogdet(spread)[1])


def test_a_sample_beyond_the_gate_is_left_out_until_it_has_lasted():
    rng = np.random.default_rng(1)
    streak, found = np.zeros((1, 1), dtype=np.int64), []
    for offset in [0.1, 9.0, 0.1, 9.0, 9.0, 9.0, 9.0, 9.0, 0.1, 9.0]:
        innovation = np.empty((1, 1))
        correct(
            np.array([[offset]]), np.array([[3.0]]), streak, np.zeros((1, 1, 3)),
            rng.normal(size=(1, 3, 1)), np.zeros((1, 1, 3)), np.ones((1, 1, 1)),
            np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1, 1)),
            np.eye(2)[None], np.ones((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)),
            np.zeros(0, dtype=np.int64), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 0)),
            innovation, np.empty((1, 1)), np.empty(1), np.empty((1, 1, 1)),
        )  # fmt: skip
        found.append(bool(np.isnan(innovation[0, 0])))
    assert found == [False, True, False, True, True, True, False, False, False, True]
