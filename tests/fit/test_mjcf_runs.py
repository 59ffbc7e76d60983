"""Inputs at their own rate, noise from the data, starts that move."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.fit import Channel, JointStart, MjcfRun
from workbench.fit.systems.mjcf_runs import channel_noise, common_sample, held_control

STAMPS = np.array([0.0, 0.04, 0.08, 0.2])
VALUES = np.array([1.0, 3.0, 2.0, 5.0])
EDGES = np.arange(-0.1, 0.31, 0.01)


@pytest.mark.parametrize("hold", ["zero", "first"])
@pytest.mark.parametrize("lag", [0.0, 0.02])
def test_a_delayed_input_keeps_its_momentum(hold, lag):
    edges = np.arange(-0.1, 1.01, 0.01)
    acted = held_control(STAMPS, VALUES, hold, edges, delay=0.0137, lag=lag)
    own = {"zero": 0.04 * 1 + 0.04 * 3 + 0.12 * 2, "first": 0.04 * 2 + 0.04 * 2.5 + 0.12 * 3.5}
    before, after = 1.0 * (0.1 + 0.0137 + lag), 5.0 * (edges[-1] - 0.2 - 0.0137 - lag)
    assert acted.sum() * 0.01 == pytest.approx(before + own[hold] + after, abs=1e-9)


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_a_delay_far_below_a_sample_shows(hold):
    here, later = (held_control(STAMPS, VALUES, hold, EDGES, delay) for delay in (0.0, 1e-5))
    assert np.abs(later - here).max() == pytest.approx(
        {"zero": 3.0, "first": 50.0 * 0.01}[hold] * 1e-3, rel=0.3
    )


def test_a_lag_that_vanishes_is_none_and_one_that_is_small_is_a_delay():
    none, least, small, late = (
        held_control(STAMPS, VALUES, "first", EDGES, delay, lag)
        for delay, lag in ((0.0, 0.0), (0.0, 1e-9), (0.0, 1e-4), (1e-4, 0.0))
    )
    assert least == pytest.approx(none, abs=1e-5)
    assert small - none == pytest.approx(late - none, abs=0.1 * np.abs(late - none).max())


def test_a_smooth_input_acts_with_its_full_amplitude():
    sample, omega = 0.01, 40.0
    stamps = np.arange(0, 2.0005, 0.001)
    edges = np.arange(0, 2, sample)
    acted = held_control(stamps, np.sin(omega * stamps), "first", edges)
    phase = np.exp(-1j * omega * (edges[:-1] + sample / 2))
    held = np.sinc(omega * sample / 2 / np.pi)  # of a constant over one sample
    inner = slice(5, 5 + 157)  # ten periods of 40 rad/s
    amplitude = 2 * held * np.abs(np.mean(acted[inner] * phase[inner]))
    assert amplitude == pytest.approx(1, abs=2e-3)  # the plain mean gives 0.987


def test_a_channel_of_coarse_steps_needs_its_noise_stated():
    times = np.arange(0, 3, 0.01)
    run = MjcfRun("steps", times, np.round(np.sin(times)[:, None] * 10) / 10)
    with pytest.raises(InputError, match="channel angle: its noise cannot be found"):
        channel_noise([Channel("angle", "position", "pivot")], [run])
    assert channel_noise([Channel("angle", "position", "pivot", sigma=0.03)], [run]) == [0.03]


def test_a_moving_start_is_read_from_the_first_samples():
    times = np.arange(0, 1, 0.01)
    values = 0.3 + 2.0 * times - 1.5 * times**2
    values[1] = np.nan
    start = JointStart.seen(times, values, 1e-4)
    assert (start.position, start.speed) == pytest.approx((0.3, 2.0))
    assert 1e-4 < start.position_deviation < 1e-2
    with pytest.raises(InputError, match="only 4 were seen"):
        JointStart.seen(times[:4], np.zeros(4), 1e-4)


def test_uneven_stamps_are_refused_with_the_one_that_is_off():
    times = np.arange(0, 1, 0.01)
    times[40] += 0.004
    with pytest.raises(InputError, match=r"late: stamp 0\.404 s"):
        MjcfRun("late", times, np.zeros((100, 1)))


def test_runs_of_two_rates_are_refused():
    runs = [MjcfRun(f"at {r}", np.arange(50) / r, np.zeros((50, 1))) for r in (100, 120)]
    with pytest.raises(InputError, match="at 100 100 Hz, at 120 120 Hz"):
        common_sample(runs)
