"""Delays of a part of a sample and clocks that drift, against those that were put in."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.motion import ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import clock_fit, delay

RATE = 120.0
SPEED = 17.0
NOISE = 2e-4
STEPS = ((0.0, 5.0), (0.1, 11.0), (0.2, SPEED), (10.0, 0.0))


def sway(t: np.ndarray, late: float = 0.0, noise: float = 0.0, seed: int = 0) -> TimeSeries:
    """Return the height of T, swaying at 17 rad/s, twice that and a slow third."""
    u = t - late
    z = 0.01 * np.sin(SPEED * u) + 0.004 * np.cos(2 * SPEED * u + 1) + 0.003 * np.sin(4.1 * u)
    shaken = z + np.random.default_rng(seed).normal(0, noise, len(t))
    return TimeSeries.of(t, {TOP[2]: shaken})


@pytest.mark.parametrize("samples", [0.3, -1.7, 4.25])
def test_a_delay_of_a_part_of_a_sample_is_found_and_its_error_covers(samples: float) -> None:
    t = np.arange(-60, 1200) / RATE
    apart = []
    for seed in range(30):
        real = sway(t, samples / RATE, NOISE, seed)
        holed = np.random.default_rng(seed).random(len(t)) > 0.03
        real = TimeSeries.of(t, {TOP[2]: real[TOP[2]]}, {TOP[2]: holed})
        found = delay(real, sway(t), TOP[2], 0.0, 9.0)
        assert found.seconds * RATE == pytest.approx(samples, abs=0.02)
        assert found.left == pytest.approx(NOISE, rel=0.15)
        apart.append((found.seconds - samples / RATE) / found.standard_error)
    assert 0.6 < np.std(apart) < 1.6
    assert abs(np.mean(apart)) < 0.8


def test_level_and_size_may_differ() -> None:
    t = np.arange(1200) / RATE
    real = sway(t, 0.3 / RATE)
    bigger = TimeSeries.of(t, {TOP[2]: 0.2 + 1.1 * real[TOP[2]]})
    found = delay(bigger, sway(t), TOP[2], 0.5, 9.0)
    assert found.seconds * RATE == pytest.approx(0.3, abs=1e-3)


def test_a_delay_out_of_reach_is_refused() -> None:
    t = np.arange(1200) / RATE
    with pytest.raises(InputError, match=r"no shift within 0\.05 s fits best"):
        delay(sway(t, 0.08), sway(t), TOP[2], 0.5, 9.0)
    with pytest.raises(InputError, match=r"1\d samples from 9\.8 to 9\.9 s lie in both"):
        delay(sway(t), sway(t), TOP[2], 9.8, 9.9)


def filmed(
    offset: float, rate: float, ratio: float, seconds: float = 11.0, seed: int = 0
) -> TimeSeries:
    """Return the rotor's angle on a camera clock, the motor integrated step by step."""
    t = np.arange(-240, round(seconds * RATE)) / RATE
    bench = (t - offset) / (1 + rate)
    fine = np.arange(-3.0, 14.0, 1e-4)
    wanted = np.zeros_like(fine)
    for begin, speed in STEPS:
        wanted[fine >= begin] = speed
    speed, turned = np.zeros_like(fine), np.zeros_like(fine)
    for k in range(1, len(fine)):
        lag = 0.05 if wanted[k] else 0.12
        speed[k] = speed[k - 1] + (wanted[k - 1] - speed[k - 1]) * 1e-4 / lag
        turned[k] = turned[k - 1] + speed[k - 1] * 1e-4
    angle = 1.2 + ratio * np.interp(bench, fine, turned)
    angle += 0.05 * np.sin(angle + 0.3) * np.interp(bench, fine, speed) / SPEED
    shaken = angle + np.random.default_rng(seed).normal(0, 0.006, len(t))
    return TimeSeries.of(t, {ROTOR_ANGLE: shaken})


@pytest.mark.parametrize(("offset", "ppm", "ratio"), [(0.0123, 800.0, 0.99), (-0.03, -300.0, 1.02)])
def test_offset_and_drift_of_a_clock_are_told_from_the_motors_speed(
    offset: float, ppm: float, ratio: float
) -> None:
    found = clock_fit(filmed(offset, ppm * 1e-6, ratio), STEPS)
    assert found.drift_ppm is not None
    assert found.drift_error_ppm is not None
    assert abs(found.offset_s - offset) < max(3 * found.offset_error_s, 1e-3)
    assert abs(found.drift_ppm - ppm) < 3 * found.drift_error_ppm
    assert found.offset_error_s < 2e-3
    assert found.drift_error_ppm < 200
    assert found.lag_s == pytest.approx(0.05, abs=0.005)
    assert found.speed_ratio == pytest.approx(ratio, rel=1e-3)
    assert found.left_rad == pytest.approx(0.006, rel=0.15)


def test_without_the_stop_the_rate_is_not_told() -> None:
    found = clock_fit(filmed(0.0123, 0.0, 1.0, seconds=9.0), STEPS)
    assert (found.drift_ppm, found.drift_error_ppm) == (None, None)
    assert found.offset_s == pytest.approx(0.0123, abs=3e-3)


def test_too_little_for_clocks_is_refused() -> None:
    with pytest.raises(InputError, match=r"1 commanded step\(s\) and \d+ samples"):
        clock_fit(filmed(0.0, 0.0, 1.0), STEPS[:1])


def test_a_rotor_that_stops_on_the_way_tells_no_clock() -> None:
    motion = filmed(0.0, 0.0, 1.0)
    angle = motion[ROTOR_ANGLE].copy()
    angle[motion.times > 4] = angle[motion.times > 4][0]  # the robot fell
    with pytest.raises(InputError, match="does not follow the commanded steps; did the robot fall"):
        clock_fit(TimeSeries.of(motion.times, {ROTOR_ANGLE: angle}), STEPS)
