"""Frequency, damping and displacement of a released robot, against closed form and linear modes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.motion import FOOT, TOP, summarize_release, time_zero
from workbench.motion.ringdown import ring
from workbench.schemas import load_model, load_shape
from workbench.sim import Condition, Robot, linear_modes, make_robot, sample_times, simulate
from workbench.timeseries import TimeSeries

RATE = 120.0
NOISE_M = 3e-4


@pytest.fixture(scope="module")
def robot() -> Robot:
    here = Path()
    return make_robot(
        load_model("thesis", here).content.values(), load_shape("thesis-initial", here).content
    )


def swing(
    t: np.ndarray, hz: float, damping_ratio: float, amplitude: float, phase: float = 0.0
) -> np.ndarray:
    """A viscous swing, its damped frequency given."""
    omega = 2 * np.pi * hz
    fade = np.exp(-omega * damping_ratio / np.sqrt(1 - damping_ratio**2) * t)
    return amplitude * fade * np.cos(omega * t + phase)


@pytest.mark.parametrize("seconds", [3.0, 10.0])
@pytest.mark.parametrize("damping_ratio", [0.002, 0.02, 0.1])
def test_the_strongest_of_two_swings_is_told_under_noise(
    damping_ratio: float, seconds: float
) -> None:
    t = np.arange(0, seconds, 1 / RATE)
    path = 0.1 + swing(t, 1.64, damping_ratio, 0.015) + swing(t, 2.9, 0.006, 0.004, 1.0)
    found = ring(t, path + np.random.default_rng(2).normal(0, NOISE_M, len(t)))
    assert found.hz == pytest.approx(1.64, rel=0.003)
    assert found.damping_ratio == pytest.approx(damping_ratio, abs=0.0005 + 0.02 * damping_ratio)
    assert found.centre == pytest.approx(0.1, abs=1e-4)


def test_a_gap_makes_no_difference() -> None:
    t = np.arange(0, 5, 1 / RATE)
    path = swing(t, 2.0, 0.01, 0.01)
    path[200:260] = np.nan
    assert ring(t, path).hz == pytest.approx(2.0, rel=1e-4)
    assert ring(t, path).damping_ratio == pytest.approx(0.01, rel=0.01)


def test_noise_alone_does_not_ring() -> None:
    t = np.arange(0, 5, 1 / RATE)
    assert np.isnan(ring(t, np.random.default_rng(1).normal(0.1, 1e-5, len(t))).hz)
    assert np.isnan(ring(t[:20], t[:20]).hz)
    assert np.isnan(ring(t, np.full(len(t), np.nan)).centre)


def test_a_small_pull_rings_as_the_linear_mode_of_the_locked_rotor(robot: Robot) -> None:
    condition = Condition("decay", np.zeros(len(sample_times(10.0))), rest=0.6, pull=0.02)
    found = summarize_release(simulate(robot, condition).motion, "decay", 10.0)
    mode = linear_modes(robot, rotor_angle=np.pi / 2)[0]
    assert found.ring_hz == pytest.approx(mode.hz, rel=1e-3)
    assert found.damping_ratio == pytest.approx(mode.damping_ratio, rel=0.01)


def test_displacement_in_a_decay_is_how_far_t_was_pulled(robot: Robot) -> None:
    zeros = np.zeros(len(sample_times(6.0)))
    pulled, free = (
        simulate(robot, Condition("decay", zeros, rest=0.6, pull=pull)).motion for pull in (0.1, 0)
    )
    truth = pulled[TOP[0]][0] - free[TOP[0]][0]
    found = summarize_release(pulled, "decay", 6.0)
    assert found.displacement_m == pytest.approx(truth, rel=0.005)


def test_displacement_in_a_drop_is_how_far_the_foot_fell() -> None:
    t = np.arange(-1, 5, 1 / RATE)
    fall = np.clip(-4.9 * np.maximum(t, 0) ** 2, -0.025, 0)
    top = 0.27 + fall + np.where(t > 0, swing(np.maximum(t, 0), 2.8, 0.03, 0.01), 0)
    columns = dict.fromkeys((*FOOT, *TOP), np.zeros(len(t))) | {FOOT[2]: fall, TOP[2]: top}
    found = summarize_release(TimeSeries.of(t, columns), "drop", 4.0)
    assert found.displacement_m == pytest.approx(0.025)
    assert found.ring_hz == pytest.approx(2.8, rel=1e-3)
    assert found.damping_ratio == pytest.approx(0.03, rel=0.01)


def test_only_a_released_robot_is_summed_up_as_one() -> None:
    still = TimeSeries.of([0.0, 1.0], {name: [0.0, 0.0] for name in (*TOP, *FOOT)})
    with pytest.raises(InputError, match=r"no mode with a release named 'dcay'; did you mean 'dec"):
        summarize_release(still, cast(Any, "dcay"), 1.0)
    with pytest.raises(InputError, match=r"no mode named 'hopp'; did you mean 'hop'\?; there are"):
        time_zero(cast(Any, "hopp"), still)
