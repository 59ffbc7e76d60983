"""Constructed failures: each is reported, none is fitted silently."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bank.courses import Course
from tests.fit.filmed import ROBOT, hopper, measured, ramp, twin_motion
from workbench.errors import InputError
from workbench.fit import Estimator, Fit, Hopper, MeasuredRun, ParameterVector, warnings_of
from workbench.timeseries import TimeSeries

COURSE = Course("clamped", 3.0, ramp(11.0))
NOISE = {"beam": 2e-4, "foot": 5e-3}


def run(course: Course = COURSE) -> MeasuredRun:
    return measured(twin_motion(course), course)


def words(one: MeasuredRun) -> list[str]:
    """What is said of a run that was observed with the nominal model, not fitted."""
    system = Hopper(ROBOT, [one])
    for _ in range(2):
        system = system.refined([part.qpos for part in observed(system).innovations])
    return warnings_of(observed(system))


def observed(system: Hopper) -> Fit:
    x = np.zeros(len(system.parameters))
    estimator = Estimator.of(system, ParameterVector(system.parameters), NOISE, threads=1)
    found = tuple(estimator.innovations(x, keep=True))
    return Fit(estimator, x, found, np.zeros((0, len(x))), 1, True)


def with_values(one: MeasuredRun, motion: TimeSeries) -> MeasuredRun:
    return replace(one, motion=motion)


def test_a_sound_run_is_not_complained_of() -> None:
    assert words(run()) == []


def test_a_camera_at_60_hz_is_refused() -> None:
    motion = run().motion
    half = TimeSeries(motion.times[::2], motion.values[::2], motion.names, motion.valid[::2])
    with pytest.raises(InputError, match="60 samples a second, the observer needs 120"):
        Hopper(ROBOT, [with_values(run(), half)])


def test_a_channel_that_is_away_for_a_second_is_named() -> None:
    motion = run().motion
    valid = motion.valid.copy()
    away = (motion.times > 1.0) & (motion.times <= 2.0)
    valid[away, motion.names.index("top_z_m")] = False
    (said,) = words(
        with_values(run(), TimeSeries(motion.times, motion.values, motion.names, valid))
    )
    assert "top_z_m was not seen for 1 s" in said


def test_a_clock_that_drifts_a_thousandth_is_reported() -> None:
    course = Course("clamped", 10.0, ramp(8.5))
    motion = run(course).motion
    kept = motion.between(-np.inf, motion.times[-1] / (1 + 1e-3))
    late = motion.at(kept.times * (1 + 1e-3))
    drifting = TimeSeries(kept.times, late.values, late.names, late.valid)
    (said,) = words(with_values(run(course), drifting))
    assert "the rotor turned +0.10 % against its command" in said


def test_a_run_of_another_robot_is_lost() -> None:
    values = dict(ROBOT.values) | {"root_stiffness": 24.0, "top_mass": 0.2}
    other = hopper(twin_motion(COURSE), COURSE)
    system = Hopper(replace(ROBOT, values=values), other.runs)
    said = warnings_of(observed(system))
    assert any("the observer lost the robot" in one and "run of this robot" in one for one in said)
