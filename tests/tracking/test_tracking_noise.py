"""Noise floors and harmonics against noise and harmonics that were put in."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.errors import InputError
from workbench.motion import FOOT, ROTOR_ANGLE, ROTOR_SPEED, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import noise_floor, synchronous

RATE = 120.0
SPEED = 17.0
NOISE = 2e-4
HARMONICS = {1: 0.02 - 0.01j, 2: 0.003 + 0.004j, 3: -0.001j}


def motion(
    seed: int = 1, noise: float = NOISE, memory: float = 0.0, gaps: float = 0.02
) -> TimeSeries:
    """Return T swaying in three harmonics after 2 s of rest, on a slow drift."""
    rng = np.random.default_rng(seed)
    t = np.arange(-240, 1200) / RATE
    phi = 0.4 + SPEED * np.maximum(t, 0.0)
    sway = sum((h * np.exp(1j * k * phi)).real for k, h in HARMONICS.items())
    shaken = lfilter([np.sqrt(1 - memory**2)], [1, -memory], rng.normal(0, noise, len(t)))
    top = 0.1 + np.where(t > 0, sway, 0.0) + 0.002 * np.maximum(t, 0.0) + shaken
    valid = {TOP[0]: rng.random(len(t)) > gaps}
    columns = {
        TOP[0]: np.where(valid[TOP[0]], top, np.nan),
        FOOT[0]: rng.normal(0, noise, len(t)),
        ROTOR_ANGLE: phi + rng.normal(0, 1e-3, len(t)),
        ROTOR_SPEED: np.where(t > 0, SPEED, 0.0),
    }
    return TimeSeries.of(t, columns, valid)


def test_rest_white_and_synchronous_noise_are_the_noise_that_was_added() -> None:
    found = noise_floor(motion())
    assert set(found) == {TOP[0], FOOT[0], ROTOR_ANGLE}
    for name in (TOP[0], FOOT[0]):
        told = found[name]
        for value in (told.rest, told.white, told.synchronous):
            assert value == pytest.approx(NOISE, rel=0.15)
        assert told.correlation_s == pytest.approx(1 / RATE, rel=0.3)
        assert told.turns == pytest.approx(24, abs=1)
    assert found[ROTOR_ANGLE].synchronous == pytest.approx(1e-3, rel=0.15)


def test_noise_with_memory_is_not_white() -> None:
    many = [noise_floor(motion(seed, memory=0.9))[TOP[0]] for seed in range(8)]
    # a line through 2 s takes a part of noise that remembers itself for 0.16 s
    assert np.mean([n.rest for n in many if n.rest]) == pytest.approx(0.9 * NOISE, rel=0.15)
    told = many[1]
    assert told.white is not None
    assert told.white < 0.5 * NOISE
    assert told.synchronous == pytest.approx(NOISE, rel=0.2)
    assert told.correlation_s == pytest.approx(1.9 / 0.1 / RATE, rel=0.4)


def test_what_cannot_be_told_is_none() -> None:
    run = motion()
    driven = noise_floor(run.between(0.0, 1.8))[TOP[0]]
    assert (driven.rest, driven.synchronous, driven.correlation_s) == (None, None, None)
    assert driven.white == pytest.approx(NOISE, rel=0.3)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_harmonics_are_recovered_and_their_errors_cover(memory: float) -> None:
    apart = []
    for seed in range(40):
        fit = synchronous(motion(seed, memory=memory), TOP[0], 4, 1.0, 9.9)
        assert fit.coefficients[0] == pytest.approx(0.1 + 0.002 * 5.45, abs=2e-4)
        for k, truth in HARMONICS.items():
            miss = fit.coefficients[k] - truth
            place = 2 * k - 1
            errors = np.sqrt(np.diag(fit.covariance)[place : place + 2])
            apart += [miss.real / errors[0], miss.imag / errors[1]]
        assert abs(fit.coefficients[4]) < 5 * np.sqrt(np.diag(fit.covariance)[7:9].sum())
    assert 0.75 < np.std(apart) < 1.4
    assert np.mean(np.abs(apart) < 2) > 0.85


def test_too_few_turns_are_refused() -> None:
    with pytest.raises(InputError, match=r"top_x_m and the rotor .* over 2\.\d turns"):
        synchronous(motion(), TOP[0], 4, 1.0, 2.0)
