"""The robot as a system: what is seen of it, and effects as parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from benchmarks.bank.courses import TIP, Course
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.fit import (
    Estimator,
    Hopper,
    Parameter,
    ParameterVector,
    Scope,
    covariance,
    fit_system,
    intervals,
    refined,
)
from workbench.motion import PITCH, ROTOR_ANGLE
from workbench.timeseries import TimeSeries

K3 = 40.0  # [N m/rad^3]


def test_a_drop_s_pitch_is_seen_with_its_own_noise() -> None:
    course = Course("drop", 1.0, height=0.02)
    seen = measured(twin_motion(course), course)
    motion = seen.motion
    pitch = np.random.default_rng(0).normal(0.0, 2e-3, len(motion.times))
    columns = {name: motion[name] for name in motion.names} | {PITCH: pitch}
    run = replace(seen, motion=TimeSeries.of(motion.times, columns))
    system = Hopper(ROBOT, [run])
    assert system.channels_of(0)[-1] == PITCH
    assert system.sigma(0).shape == (5,)
    assert system.sigma(0)[-1] == pytest.approx(2e-3, rel=0.2)
    job = system.start(0, {}, coarse=False)
    assert job.observation.bias.shape == (5,)


@pytest.mark.budget(25)  # a whole fit of the robot
def test_an_effect_hidden_in_ring_downs_is_found_as_a_candidate() -> None:
    courses = [Course("decay", 2.0, pull=pull) for pull in (0.3, 0.9)]
    hidden = {"hinge_cubic_stiffness": {"k3": K3}}
    runs = [measured(twin_motion(one, hidden), one, k) for k, one in enumerate(courses)]
    k3 = Parameter("hinge_cubic_stiffness k3", "N m/rad^3", 0.0, 20.0, -500.0, 500.0,
                   Scope.CANDIDATE, flat=True)  # fmt: skip
    system = Hopper(ROBOT, runs, candidates={k3: ("hinge_cubic_stiffness", "k3")})
    fit = fit_system(system, ParameterVector(system.parameters))
    found = intervals(fit, covariance(fit))[k3]
    assert found.high - found.low < 0.3 * K3
    assert abs(found.value - K3) < found.high - found.low
    assert system.robot_with({k3: 7.0}).effects["hinge_cubic_stiffness"]["k3"] == 7.0


def test_near_a_resonance_the_rotor_s_angle_is_right_whatever_the_process_noise() -> None:
    course = Course("clamped", 6.0, ramp(11.0))
    motion = twin_motion(course)
    system = Hopper(ROBOT, [measured(motion, course)])
    vector = ParameterVector(system.parameters)
    weak = Estimator.of(system, vector, {"beam": 1e-6, "foot": 1e-6})
    found = cast("Hopper", refined(weak, np.zeros(len(vector))).system)
    angle = found.turned[0]
    assert angle is not None
    against_top = motion[ROTOR_ANGLE] - motion[TIP]
    error = angle - np.interp(found.times(0), motion.times, against_top)
    assert np.std(error) < 2.5e-3  # cameras see it within 9 mrad, before it is smoothed
