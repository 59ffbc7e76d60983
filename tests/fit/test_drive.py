"""The rotor's angle from what cameras saw: smooth, and without their glitches."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from workbench.fit import commanded_angle, fit_drive

SIGMA = 0.017  # a rotor 35 mm from T, each seen to half a millimetre [rad]
STEPS = ((0.0, 6.0), (0.25, 12.0))


@pytest.mark.parametrize("sample", [0, 1, 180, 358, 359])
def test_a_glitch_does_not_bend_the_angle_wherever_it_lies(sample: int) -> None:
    times = np.arange(360) / 120
    true = 0.3 + commanded_angle(times, STEPS, 1.0, 0.05, 0.01)
    noise = SIGMA * np.random.default_rng(1).standard_normal(360)
    clean = fit_drive(times, true + noise, STEPS, SIGMA, 0 * times)
    seen = true + noise
    seen[sample] -= 0.36
    found = fit_drive(times, seen, STEPS, SIGMA, 0 * times)
    assert np.abs(found.angle - clean.angle).max() < SIGMA / 4


def test_a_ripple_is_no_reason_to_believe_the_noise() -> None:
    times = np.arange(1200) / 120
    usual, share = commanded_angle(times, STEPS, 1.0, 0.07, 0.0), 0.12
    turn = 0.2 * np.sin(9.0 * times) * np.exp(-times)  # of T
    ripple = 0 * times
    for _ in range(20):  # the speed depends on where the rotor is
        rate = share * np.gradient(usual, times) * np.cos(usual + ripple + turn)
        ripple = cumulative_trapezoid(rate, times, initial=0.0)
    noise = SIGMA * np.random.default_rng(2).standard_normal(len(times))
    found = fit_drive(times, usual + ripple + turn + noise, STEPS, SIGMA, turn)
    left = found.angle - usual - ripple
    assert np.std(left) < SIGMA / 8
    assert np.abs(left).max() < SIGMA
    assert (found.lag, found.delay) == (pytest.approx(0.07, abs=0.01), pytest.approx(0, abs=0.01))


def test_a_rotor_that_stands_is_smoothed_too() -> None:
    times = np.arange(240) / 120
    noise = SIGMA * np.random.default_rng(3).standard_normal(len(times))
    found = fit_drive(times, 1.5 + noise, ((0.0, 0.0),), SIGMA, 0 * times)
    assert np.abs(found.angle - 1.5).max() < SIGMA / 2
