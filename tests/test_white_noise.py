"""Deviations of noise that was put in, beside motion, gaps, glitches and coarse steps."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.noise import robust_sigma, white_noise

RNG = np.random.default_rng(2)


def test_normal_noise_has_its_deviation_whatever_a_tenth_of_it_is() -> None:
    values = RNG.normal(0, 3.0, (4000, 2))
    values[::20] = 1e6
    values[1::20] = np.nan
    assert robust_sigma(values, axis=0) == pytest.approx([3.0, 3.0], rel=0.1)
    assert robust_sigma(values) == pytest.approx(3.0, rel=0.1)


def test_a_constant_counts_unless_it_is_taken_off() -> None:
    values = 100 + RNG.normal(0, 3.0, (4000, 2)) + [0, 50]
    assert robust_sigma(values, centred=True, axis=0) == pytest.approx([3.0, 3.0], rel=0.1)
    assert robust_sigma(values[:, 0]) > 100
    assert robust_sigma(values[:, 0], centred=True) == pytest.approx(3.0, rel=0.1)


def test_noise_is_found_at_nine_samples_a_period() -> None:
    rng, t = np.random.default_rng(6), np.arange(3000)
    values = 0.1 * np.sin(2 * np.pi * t / 9.1) + 5e-4 * rng.normal(size=len(t))
    values[100:140] = np.nan
    assert white_noise(values) == pytest.approx(5e-4, rel=0.08)


@pytest.mark.parametrize("order", [1, 2, 3, 6])
def test_each_order_finds_the_same_noise(order: int) -> None:
    values = RNG.normal(0, 2e-3, 20_000)
    assert white_noise(values, (order,)) == pytest.approx(2e-3, rel=0.05)
    assert white_noise(values, (order,), sigma=np.std) == pytest.approx(2e-3, rel=0.03)


def test_too_few_samples_tell_nothing_and_coarse_steps_no_noise() -> None:
    assert np.isnan(white_noise(RNG.normal(size=14), (3,)))
    assert white_noise(RNG.normal(size=15), (3,)) > 0
    assert np.isnan(white_noise(np.full(50, np.nan)))
    assert white_noise(np.ones(50)) == 0
