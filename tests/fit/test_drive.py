"""The rotor's angle from what cameras saw: smooth, and without their glitches."""

from __future__ import annotations

import numpy as np
import pytest

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
