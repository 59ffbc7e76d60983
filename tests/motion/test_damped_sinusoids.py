"""Fading swings against closed form: frequency, decay, amplitude, and how sure they are."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.motion import DampedSinusoid, fit_sinusoids

RATE = 120.0
NOISE_M = 3e-4
TRUTH = (DampedSinusoid(1.64, 0.062), DampedSinusoid(2.9, 0.146))  # damping ratios 0.6 % and 0.8 %
AMPLITUDES = np.array([[0.015, 0.004j], [0.003j, -0.006]])


def paths(t: NDArray[np.float64], seed: int, noise: float = NOISE_M) -> NDArray[np.float64]:
    """Two swings along x and z about (0.1, 0.27), with white noise."""
    centre = np.array([0.1, 0.27])
    swings = sum(
        np.real(np.outer(np.exp((2j * np.pi * pole.hz - pole.decay) * t), amplitude))
        for pole, amplitude in zip(TRUTH, AMPLITUDES, strict=True)
    )
    return centre + swings + np.random.default_rng(seed).normal(0, noise, (len(t), 2))


def test_two_modes_under_noise_are_told_within_a_thousandth_and_five_percent() -> None:
    t = np.arange(0, 10, 1 / RATE)
    found = fit_sinusoids(t, paths(t, 1), 2)
    for pole, truth in zip(found.sinusoids, TRUTH, strict=True):
        assert pole.hz == pytest.approx(truth.hz, rel=1e-3)
        assert pole.damping_ratio == pytest.approx(truth.damping_ratio, rel=0.05)
    assert np.abs(found.amplitudes - AMPLITUDES).max() < 1e-4
    assert found.beside[0] == pytest.approx([0.1, 0.27], abs=5e-5)
    assert found.residual.std() == pytest.approx(NOISE_M, rel=0.05)


def test_errors_are_as_large_as_the_scatter_of_repeats() -> None:
    t = np.arange(0, 2.5, 1 / RATE)
    fits = [fit_sinusoids(t, paths(t, seed), 2, start=TRUTH) for seed in range(60)]
    for k in range(2):
        off = np.array([f.sinusoids[k] for f in fits]) - TRUTH[k]
        stated = np.array([f.sinusoid_errors[k] for f in fits])
        assert np.std(off / stated, axis=0) == pytest.approx([1, 1], abs=0.3)


def test_what_is_beside_the_swings_is_told_apart_from_them() -> None:
    t = np.arange(0, 6, 1 / RATE)
    drive = np.column_stack([np.cos(14 * t), np.sin(14 * t)])
    factors = np.array([[0.02, 0.0], [0.0, -0.01]])
    found = fit_sinusoids(t, paths(t, 3) + drive @ factors, 2, beside=drive)
    assert found.beside[1:] == pytest.approx(factors, abs=1e-4)
    assert found.sinusoids[0].hz == pytest.approx(TRUTH[0].hz, rel=1e-3)
    error = np.sqrt(found.beside_covariance[0].diagonal()[1:])
    assert np.all(error < 1e-4)
    assert np.all(error > 1e-5)


def test_with_no_swing_the_centre_alone_is_fitted() -> None:
    t = np.arange(0, 2, 1 / RATE)
    found = fit_sinusoids(t, np.full((len(t), 1), 0.3), 0)
    assert found.sinusoids == ()
    assert found.beside[0, 0] == pytest.approx(0.3)


def test_unseen_samples_do_not_count_and_too_few_are_refused() -> None:
    t = np.arange(0, 4, 1 / RATE)
    path = paths(t, 4)
    path[100:160, 0] = np.nan
    found = fit_sinusoids(t, path, 2)
    assert found.sinusoids[0].hz == pytest.approx(TRUTH[0].hz, rel=2e-3)
    assert np.isnan(found.residual[100:160]).all()
    with pytest.raises(ValueError, match="59 samples determine no sinusoid; 60 do"):
        fit_sinusoids(t[:59], path[:59], 1)
