"""Predictions from the estimated state: at the noise where nothing is hidden, else growing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bank.courses import Course
from tests.fit.filmed import NOISE_M, ROBOT, hopper, measured, ramp, twin_motion
from workbench.errors import InputError
from workbench.fit import MeasuredRun, estimate, observe, paced, pose, replayed
from workbench.fit.prediction import Horizon, prediction_errors
from workbench.fit.state import observed
from workbench.motion import TOP, misfit
from workbench.timeseries import TimeSeries

CLAMPED = Course("clamped", 4.0, ramp(8.5))
HOP = Course("hop", 4.0, ramp(17.0))
NOISE_MM = 1000 * NOISE_M * np.sqrt(2)


@pytest.mark.parametrize("course", [CLAMPED, HOP], ids=lambda c: c.mode)
def test_a_prediction_is_the_observer_left_alone_from_its_start_on(course: Course) -> None:
    one = observed(hopper(twin_motion(course), course), coarse=True)
    start, ahead = 36, 60  # the first start, 0.3 s after the first sample, in the run-up
    seen = one.job.seen.copy()
    seen[start + 1 :] = np.nan
    (alone,) = observe([replace(one.job, seen=seen)], threads=1, keep=True)
    times = one.system.times(0)
    motion = pose(ROBOT, one.job.model, times, alone.qpos, np.zeros(3))
    names = one.system.runs[0].places
    places = motion.select(names).values + one.job.observation.bias[: len(names)]
    last = slice(start + 1 + round(0.9 * ahead), start + ahead + 1)
    square = (one.job.seen[:, : len(names)] - places)[last] ** 2
    wanted = 1000 * np.sqrt(2 * square.mean())
    found = prediction_errors(one, [Horizon(ahead / 120, 1)])
    assert found[ahead / 120] == pytest.approx(wanted, rel=0.02 if course is HOP else 1e-6)


def test_with_nothing_hidden_predictions_are_off_by_the_noise() -> None:
    one = observed(hopper(twin_motion(CLAMPED), CLAMPED))
    for seconds, mm in prediction_errors(one).items():
        assert mm == pytest.approx(NOISE_MM, rel=0.3), seconds
    left = replayed(ROBOT, one.system.runs[0])
    assert left.rms_mm == pytest.approx(NOISE_MM, rel=0.1)
    assert left.noise_mm == pytest.approx(NOISE_MM, rel=0.1)


def test_what_a_model_lacks_grows_with_the_time_ahead() -> None:
    motion = twin_motion(CLAMPED, {"tether": {"stiffness": 0.7}})
    errors = list(prediction_errors(observed(hopper(motion, CLAMPED), coarse=True)).values())
    assert errors[0] < errors[1] < errors[2]
    assert errors[2] > 2.0


def test_a_drive_that_turns_otherwise_than_commanded_is_not_the_model_s_error() -> None:
    run = measured(twin_motion(CLAMPED), CLAMPED)
    slower = replace(run, steps=tuple((t, 0.95 * speed) for t, speed in run.steps))
    found = estimate(ROBOT, slower)
    assert found.measured_input_mm is not None
    assert found.measured_input_mm < 2 * NOISE_MM
    assert found.measured_start_mm == pytest.approx(NOISE_MM, rel=0.3)
    assert found.compared_s == pytest.approx(CLAMPED.duration, abs=0.01)
    commanded = twin_motion(CLAMPED._replace(steps=slower.steps))
    assert misfit(run.motion, commanded, CLAMPED.duration).top_mm > 20 * NOISE_MM
    assert found.prediction_mm["2"] == pytest.approx(NOISE_MM, rel=0.3)


def test_a_run_too_short_for_a_horizon_has_no_error_there() -> None:
    short = Course("decay", 1.2, pull=0.4)
    found = estimate(ROBOT, measured(twin_motion(short), short))
    assert found.prediction_mm["2"] is None
    assert found.prediction_mm["0.1"] == pytest.approx(NOISE_MM, rel=0.6)


def at_rate(motion: TimeSeries) -> TimeSeries:
    return paced(MeasuredRun("run", "clamped", motion)).motion


def test_other_rates_are_thinned_or_refused_and_lost_rows_are_not_valid() -> None:
    times = np.arange(-240, 480) / 240
    double = TimeSeries.of(times, {TOP[0]: times})
    thin = at_rate(double)
    np.testing.assert_allclose(np.diff(thin.times), 1 / 120)
    np.testing.assert_allclose(thin[TOP[0]], thin.times, atol=1e-9)
    kept = np.delete(np.arange(720), [300, 301, 302, 303])
    gap = TimeSeries.of(times[kept], {TOP[0]: times[kept]})
    assert np.flatnonzero(~at_rate(gap).validity(TOP[0])).tolist() == [150, 151]
    slow = TimeSeries.of(np.arange(-100, 200) / 100, {TOP[0]: np.zeros(300)})
    with pytest.raises(InputError, match="100 samples a second; the observer takes a multiple"):
        at_rate(slow)
    with pytest.raises(InputError, match=r"less than 0\.5 s were seen"):
        at_rate(double.between(-1.0, 0.2))


def test_a_robot_that_the_model_cannot_follow_is_refused() -> None:
    run = measured(twin_motion(CLAMPED), CLAMPED)
    far = np.where(run.motion.times > 1.0, np.sin(400 * run.motion.times), 0.0)
    lost = run.motion.replaced({TOP[0]: run.motion[TOP[0]] + far})
    with pytest.raises(InputError, match=r"does not follow the robot|blew up"):
        estimate(ROBOT, replace(run, motion=lost))
