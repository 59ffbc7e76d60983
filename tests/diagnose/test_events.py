from __future__ import annotations

import numpy as np
import pytest

from tests.identify.robots import LAG_S, REST_S, SHAPE, changed, driven
from workbench.diagnose.events import LEAST_HOPS, compare_events, hop_events, twins
from workbench.fit import MeasuredRun, commanded_speed
from workbench.motion import FOOT
from workbench.protocol import ModelFile
from workbench.sim import Condition, make_robot, sample_times, simulate_all
from workbench.timeseries import TimeSeries

PERIOD_S, FLIGHT_S, APEX_M, STRIDE_M = 0.4, 0.2, 0.02, 0.01


def hopping(seconds: float) -> TimeSeries:
    """A foot that flies in parabolas and stands between them."""
    times = np.arange(round(seconds * 120)) / 120
    phase = times % PERIOD_S
    flying = phase < FLIGHT_S
    share = phase / FLIGHT_S
    z = np.where(flying, 4 * APEX_M * share * (1 - share), 0.0)
    x = STRIDE_M * (times // PERIOD_S + np.minimum(share, 1.0))
    return TimeSeries.of(times, dict(zip(FOOT, (x, 0 * x, z), strict=True)))


def twins_of(run: MeasuredRun, model: ModelFile) -> list[TimeSeries]:
    times = sample_times(float(run.motion.times[-1]))
    command = commanded_speed(times, run.steps, 1.0, LAG_S)
    robot = make_robot(model.values(), SHAPE)
    conditions = twins(Condition("hop", command, rest=REST_S))
    return [one.motion for one in simulate_all([(robot, condition) for condition in conditions])]


def test_hops_of_a_known_foot_are_told() -> None:
    events = hop_events(hopping(6.0), 0.0, 6.0)
    assert len(events) == pytest.approx(6.0 / PERIOD_S, abs=2)
    period, apex, contact, stride = events.mean(axis=0)
    assert period == pytest.approx(PERIOD_S, rel=0.01)
    assert apex == pytest.approx(APEX_M, rel=0.03)
    # below 2 mm: the standing time and the ends of each parabola
    low = FLIGHT_S * (1 - np.sqrt(1 - 2e-3 / APEX_M))
    assert contact == pytest.approx(PERIOD_S - FLIGHT_S + low, abs=1 / 120)
    assert stride == pytest.approx(STRIDE_M, rel=0.02)


def test_noise_and_a_gap_make_no_hops() -> None:
    motion = hopping(6.0)
    values = motion.values + 3e-4 * np.random.default_rng(1).standard_normal(motion.values.shape)
    values[200:206] = np.nan
    noisy = TimeSeries(motion.times, values, motion.names, np.isfinite(values))
    assert len(hop_events(noisy, 0.0, 6.0)) == len(hop_events(motion, 0.0, 6.0))


def test_a_foot_that_stands_does_not_hop() -> None:
    still = TimeSeries.of(np.arange(240) / 120, {name: np.zeros(240) for name in FOOT})
    assert hop_events(still, 0.0, 2.0).shape == (0, 4)


def test_another_friction_shows_in_the_stride() -> None:
    true = changed(friction_slide=0.25, friction_stick=0.35)
    run = driven(true, "hop", 17.0, 6.0)
    tests = {}
    for name, model in (("same", true), ("other", changed())):
        found = compare_events(run, twins_of(run, model), 1.0)
        tests[name] = {one.name: one for one in found}
    assert abs(tests["same"]["stride_m"].apart) < 3
    assert tests["other"]["stride_m"].apart < -5
    assert tests["other"]["stride_m"].p_value < 0.01


def test_too_few_hops_are_not_compared() -> None:
    run = driven(changed(), "hop", 17.0, 1.5)
    assert len(hop_events(run.motion, 0.5, 1.5)) < LEAST_HOPS
    assert compare_events(run, twins_of(run, changed()), 0.5) == ()


def test_a_twin_that_could_not_be_simulated_is_compared_with_nothing() -> None:
    run = driven(changed(), "hop", 17.0, 6.0)
    assert compare_events(run, [], 1.0) == ()
