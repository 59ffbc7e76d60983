"""Noise with a memory: found at rest, kept out of the process noise and of the rotor's angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.bank import observe
from benchmarks.bank.cases import Run
from benchmarks.bank.courses import Course
from benchmarks.bank.write import measured_run
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.fit import (
    Estimator,
    Hopper,
    MeasuredRun,
    ParameterVector,
    coloured_noise,
    commanded_angle,
    fit_drive,
    minimised,
    refined,
)
from workbench.motion import ROTOR_ANGLE, TOP

COURSE = Course("decay", 5.0, pull=0.8)


def released(noise: observe.Noise, seeds: Sequence[int]) -> list[MeasuredRun]:
    motion = twin_motion(COURSE)
    seen = [observe.film(motion, noise, np.random.default_rng(seed)) for seed in seeds]
    return [measured_run(Run(f"decay-{k}", "train", COURSE, one)) for k, one in enumerate(seen)]


def test_a_memory_is_found_at_rest_and_white_noise_has_none() -> None:
    found = coloured_noise(released("B", range(6)))
    for name in (TOP[0], TOP[2]):
        assert found[name].memory == pytest.approx(0.8, abs=0.06)
        assert found[name].sigma == pytest.approx(observe.NOISE_M, rel=0.15)
    assert coloured_noise(released("A", range(6))) == {}


def test_noise_with_a_memory_is_not_taken_for_a_missing_force() -> None:
    runs = released("B", range(4))  # of one alone, by chance, a weak correction may be likelier
    gains = {}
    for name, coloured in (("known", None), ("taken for white", {})):
        system = Hopper(ROBOT, runs, coloured=coloured)
        vector = ParameterVector(system.parameters)
        strong = refined(Estimator.of(system, vector, system.strong), np.zeros(len(vector)))
        x = minimised(strong, np.zeros(len(vector))).x
        weak = strong.with_noise({"beam": 5e-6, "foot": 5e-3})
        gains[name] = strong.log_likelihood(x) - weak.log_likelihood(minimised(weak, x).x)
    assert gains["known"] < 1
    assert gains["taken for white"] > 50


def test_innovations_of_noise_with_a_memory_are_white() -> None:
    system = Hopper(ROBOT, released("B", range(3)))
    vector = ParameterVector(system.parameters)
    x = np.zeros(len(vector))
    estimator = refined(Estimator.of(system, vector, {"beam": 5e-6, "foot": 5e-3}), x)
    for one in estimator.innovations(x):
        white = np.clip(one.white[60:], -4, 4)
        assert np.std(white) == pytest.approx(1, abs=0.12)
        for channel in white.T:
            assert abs(np.corrcoef(channel[1:], channel[:-1])[0, 1]) < 0.12


def test_a_rotor_that_turns_as_commanded_is_not_given_its_noise() -> None:
    times, steps = np.arange(1200) / 120, ramp(17.0)
    true = commanded_angle(times, steps, 1.01, 0.05, 0.0)
    wrong = {}
    for memory in (0.0, 0.8):
        left = []
        for seed in range(5):
            white = np.random.default_rng(seed).standard_normal(len(times))
            noise = 0.017 * np.asarray(lfilter([0.6], [1, -0.8], white))
            found = fit_drive(times, true + noise, steps, 0.017, 0 * times, memory)
            left.append(found.angle - true)
        wrong[memory] = float(np.sqrt(np.mean(np.square(left))))
    assert wrong[0.8] < 0.004
    assert wrong[0.0] > 2 * wrong[0.8]


def test_the_phase_of_a_rotor_is_less_sure_where_its_noise_has_a_memory() -> None:
    course = Course("clamped", 4.0, ramp(8.5))
    run = measured(twin_motion(course), course)
    white = Hopper(ROBOT, [run])
    sigma = white.rotor_noise(0).sigma
    known = Hopper(ROBOT, [run], coloured={ROTOR_ANGLE: white.rotor_noise(0)._replace(memory=0.8)})
    assert known.rotor_noise(0).sigma == sigma
    (before, *_), (after, *_) = white.own[0].phase, known.own[0].phase
    assert after.deviation == pytest.approx(3 * before.deviation)
