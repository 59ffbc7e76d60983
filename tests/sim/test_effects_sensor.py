"""Effects of the cameras and of the numerics, each by what follows from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP, position, time_zero
from workbench.sim import EFFECTS, Condition, Robot, applied, sample_times, simulate, simulate_all
from workbench.timeseries import TimeSeries

SENSOR = [effect for effect in EFFECTS.values() if effect.group == "sensor"]
QUANTITIES = [(effect.name, quantity) for effect in SENSOR for quantity in effect.quantities]


CLAMPED = Condition("clamped", np.full(len(sample_times(3.0)), 13.0), rest=0.6)


def seen(robot: Robot, effect: str = "", **values: float) -> TimeSeries:
    """The motion as the cameras have it."""
    changed = replace(robot, effects={effect: values} if effect else {})
    return simulate(changed, CLAMPED).motion


def points(motion: TimeSeries) -> NDArray[np.float64]:
    """Foot, T and rotor, (n, 3 points, 3)."""
    return np.stack([position(motion, point) for point in (FOOT, TOP, ROTOR)], axis=1)


@pytest.fixture(scope="module")
def plain(robot: Robot) -> TimeSeries:
    return seen(robot)


@pytest.mark.parametrize(("name", "quantity"), QUANTITIES)
def test_zero_is_absence_and_a_step_moves_what_is_seen(
    robot: Robot, plain: TimeSeries, name: str, quantity
) -> None:
    absent = seen(robot, name, **{quantity.name: 0.0})
    assert np.array_equal(absent.values, plain.values)
    assert np.array_equal(absent.times, plain.times)
    moved = seen(robot, name, **{quantity.name: quantity.step})
    inside = moved.at(plain.times)
    gone = np.abs(points(inside) - points(plain))
    assert np.nanmax(gone) > 0.05 * quantity.step


def test_what_is_seen_late_lags_by_velocity_times_offset(robot: Robot, plain: TimeSeries) -> None:
    late = 1e-3
    motion = seen(robot, "time_offset", late=late).at(plain.times)
    velocity = np.gradient(points(plain), plain.times, axis=0)
    smooth = slice(120, -2)
    gone = (points(motion) - points(plain))[smooth]
    slope = np.sum(gone * velocity[smooth]) / np.sum(velocity[smooth] ** 2)
    assert slope == pytest.approx(late, rel=0.02)
    lag = (motion[ROTOR_ANGLE] - plain[ROTOR_ANGLE])[smooth]
    assert lag.mean() == pytest.approx(13.0 * late, rel=0.02)


def test_a_time_zero_that_is_found_in_the_motion_undoes_a_time_offset(
    robot: Robot, plain: TimeSeries
) -> None:
    motion = seen(robot, "time_offset", late=0.05)
    zeros = [time_zero("clamped", m) for m in (plain, motion)]
    assert zeros[0] is not None
    assert zeros[1] is not None
    assert zeros[1] - zeros[0] == pytest.approx(-0.05, abs=1e-9)


def test_a_scale_lengthens_every_way_and_turns_nothing(robot: Robot, plain: TimeSeries) -> None:
    motion = seen(robot, "length_scale", share=0.02)
    apart = [np.linalg.norm(points(m)[:, 2] - points(m)[:, 1], axis=1) for m in (plain, motion)]
    assert apart[0] == pytest.approx(0.035, rel=1e-6)  # the rotor's radius is a ruler
    assert apart[1] == pytest.approx(0.035 * 1.02, rel=1e-6)
    assert np.ptp(motion[TOP[0]]) == pytest.approx(1.02 * np.ptp(plain[TOP[0]]), rel=1e-9)
    same = (PITCH, ROTOR_ANGLE, ROTOR_SPEED, "hinge_3_rad", "motor_power_W")
    for name in same:
        assert np.array_equal(motion[name], plain[name])


def test_an_offset_marker_keeps_its_distance_and_moves_only_as_the_tip_turns(
    robot: Robot, plain: TimeSeries
) -> None:
    forward, up = 0.004, -0.003
    motion = seen(robot, "marker_offset", forward=forward, up=up)
    gone = (position(motion, TOP) - position(plain, TOP))[:, [0, 2]]
    assert np.linalg.norm(gone, axis=1) == pytest.approx(np.hypot(forward, up), rel=1e-9)
    assert gone[0] == pytest.approx([forward, up], abs=1e-12)
    turned = np.arctan2(-gone[:, 1], gone[:, 0])
    tip = motion[PITCH] + sum(motion[n] for n in motion.names if n.startswith("hinge_"))
    assert turned - turned[0] == pytest.approx(tip - tip[0], abs=1e-9)
    assert np.ptp(tip) > 0.05
    for untouched in (FOOT, ROTOR):
        assert np.array_equal(position(motion, untouched), position(plain, untouched))


def test_an_offset_marker_is_no_longer_the_centre_of_the_rotor_s_circle(robot: Robot) -> None:
    motion = seen(robot, "marker_offset", up=0.005)
    arm = points(motion)[:, 2] - points(motion)[:, 1]
    lengths = np.linalg.norm(arm, axis=1)
    assert (lengths.min(), lengths.max()) == pytest.approx((0.030, 0.040), abs=1e-4)
    assert motion[ROTOR_ANGLE] == pytest.approx(
        np.unwrap(np.arctan2(-arm[:, 2], arm[:, 0])), abs=1e-9
    )
    speed = motion[ROTOR_SPEED][motion.times > 1.0]
    assert np.ptp(speed) > 13.0 * 0.005 / 0.035  # once a turn it seems to hurry


def test_a_tilt_and_an_offset_marker_may_be_seen_together(robot: Robot) -> None:
    """The angle that the tilt turned is not taken back where the marker's offset finds it anew."""
    effects = {"camera_tilt": {"tilt": 0.05}, "marker_offset": {"up": 1e-9}}
    command = np.full(len(sample_times(1.0)), 13.0)
    both = simulate(replace(robot, effects=effects), Condition("clamped", command)).motion
    tilted = simulate(
        replace(robot, effects={"camera_tilt": {"tilt": 0.05}}), Condition("clamped", command)
    ).motion
    assert both[ROTOR_ANGLE] == pytest.approx(tilted[ROTOR_ANGLE], abs=1e-6)


@pytest.mark.parametrize(("halvings", "steps"), [(1, 68), (2, 136)])
def test_a_halving_doubles_the_engine_s_steps(robot: Robot, halvings: int, steps: int) -> None:
    finer = replace(robot, effects={"time_step": {"halvings": float(halvings)}})
    assert applied(finer).steps_per_sample == steps
    assert applied(finer).step == pytest.approx(robot.step / 2**halvings)


def test_halving_the_step_moves_the_motion_ever_less(robot: Robot, plain: TimeSeries) -> None:
    """Better than first order: the second halving changes less than half as much as the first."""
    robots = [replace(robot, effects={"time_step": {"halvings": n}}) for n in (0.0, 1.0, 2.0)]
    rough, half, quarter = (points(s.motion) for s in simulate_all([(r, CLAMPED) for r in robots]))
    assert np.array_equal(rough, points(plain))
    first, second = np.abs(half - rough).max(), np.abs(quarter - half).max()
    assert first > 1e-6
    assert 0.2 < second / first < 0.45
