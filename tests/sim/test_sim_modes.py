from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from workbench.errors import InputError
from workbench.motion import TOP
from workbench.sim import (
    Condition,
    DrivenResponse,
    Robot,
    driven_peaks,
    driven_response,
    linear_modes,
    sample_times,
    simulate,
)

FLEXURAL_RIGIDITY, LENGTH, MASS = 1000.0, 1.0, 1.0  # [N m^2], [m], [kg]
ROOTS = (1.875104, 4.694091, 7.854757)  # of cos x cosh x = -1, the clamped-free beam


def cantilever(robot: Robot, increments: int) -> Robot:
    """A straight uniform strip that stands upright without gravity or anything on its end.

    Every hinge is an increment's length of strip; half of one lies between foot and first hinge.
    """
    stiffness = FLEXURAL_RIGIDITY / (LENGTH / increments)
    values = dict(robot.values) | {
        "gravity": 0.0,
        "beam_mass": MASS,
        "hinge_stiffness": stiffness,
        "root_stiffness": 2 * stiffness,
        "top_mass": 1e-6,
        "rotor_mass": 1e-6,
        "rotor_arm_mass": 1e-9,
    }
    upright = (-np.pi / 2, *[0.0] * (increments - 1))
    return Robot(values, upright, LENGTH, increments=increments)


def off_from_theory(robot: Robot, increments: int) -> NDArray[np.float64]:
    """Relative error of the first three frequencies against Euler and Bernoulli's, (3,)."""
    theory = np.square(ROOTS) * np.sqrt(FLEXURAL_RIGIDITY / (MASS * LENGTH**3)) / (2 * np.pi)
    found = linear_modes(cantilever(robot, increments), rotor_angle=0.0)
    return np.array([mode.hz for mode in found]) / theory - 1


def ringing(motion: NDArray[np.float64], times: NDArray[np.float64], guess: Sequence[float]):
    """Fit two decaying sines; return (hz, damping ratio) of the first and of the second."""

    def misfit(p: NDArray[np.float64]) -> NDArray[np.float64]:
        columns = [np.ones_like(times)]
        for hz, ratio in p.reshape(2, 2):
            omega = 2 * np.pi * hz
            envelope, phase = np.exp(-ratio * omega * times), np.sqrt(1 - ratio**2) * omega * times
            columns += [envelope * np.cos(phase), envelope * np.sin(phase)]
        basis = np.column_stack(columns)
        return 1e3 * (basis @ np.linalg.lstsq(basis, motion)[0] - motion)

    return least_squares(misfit, guess, x_scale=np.abs(guess)).x


def test_a_straight_beam_rings_as_euler_and_bernoulli_say(robot: Robot) -> None:
    assert np.abs(off_from_theory(robot, 64)).max() < 0.01  # 0.06 % found


def test_an_upright_beam_moves_its_tip_sideways(robot: Robot) -> None:
    for mode in linear_modes(cantilever(robot, 16), rotor_angle=0.0):
        assert mode.top_direction == pytest.approx((1, 0), abs=1e-6)


def test_the_straight_beam_s_error_falls_with_the_square_of_the_increments(robot: Robot) -> None:
    coarse, fine = off_from_theory(robot, 32), off_from_theory(robot, 64)
    assert coarse / fine == pytest.approx([4, 4, 4], rel=0.05)


@pytest.mark.parametrize("state", ["unloaded", "loaded"])
def test_16_increments_give_the_first_two_modes_of_64(robot: Robot, state: str) -> None:
    robot = replace(robot, state=state)  # pyright: ignore[reportArgumentType]
    listed, fine = (linear_modes(replace(robot, increments=n), count=2) for n in (16, 64))
    for coarse, exact in zip(listed, fine, strict=True):
        assert coarse.hz == pytest.approx(exact.hz, rel=0.01)


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, np.pi])
def test_a_released_robot_rings_in_its_linear_modes(robot: Robot, angle: float) -> None:
    expected = linear_modes(robot, rotor_angle=angle, count=2)
    released = Condition("decay", np.zeros(len(sample_times(20.0))), angle, pull=0.01)
    motion = simulate(robot, released).motion.between(0.5, 20.0)  # the third mode is gone by then
    guess = [0.98 * expected[0].hz, 0.004, 1.02 * expected[1].hz, 0.004]
    found = ringing(motion[TOP[0]], motion.times, guess).reshape(2, 2)
    for (hz, ratio), mode in zip(found, expected, strict=True):
        assert hz == pytest.approx(mode.hz, rel=5e-4)  # 1e-4 found
        assert ratio == pytest.approx(mode.damping_ratio, rel=0.02)


def test_the_thesis_robot_sways_and_bounces_where_the_thesis_says(robot: Robot) -> None:
    """Section 4.2 measured 1.3 and 3.2 Hz, fig. 4.3 simulates 3.066 Hz."""
    free, standing = (
        linear_modes(replace(robot, state=state), count=2) for state in ("unloaded", "loaded")
    )
    assert [mode.hz for mode in free] == pytest.approx([1.590, 2.930], abs=0.005)
    assert [mode.hz for mode in standing] == pytest.approx([1.336, 3.005], abs=0.005)
    for sway, bounce in (free, standing):
        assert sway.top_direction[0] > abs(sway.top_direction[1])
        assert bounce.top_direction[1] > abs(bounce.top_direction[0])
        for direction in (sway.top_direction, bounce.top_direction):
            assert np.hypot(*direction) == pytest.approx(1)


def test_a_point_rotor_gives_one_answer_and_a_locked_one_depends_on_its_angle(robot: Robot) -> None:
    turns = [linear_modes(robot, rotor_angle=angle)[0].hz for angle in np.arange(4) * np.pi / 2]
    assert np.ptp(turns) > 0.05
    assert min(turns) < linear_modes(robot)[0].hz < max(turns)
    short = replace(robot, values=dict(robot.values) | {"rotor_radius": 1e-4})
    locked = linear_modes(short, rotor_angle=1.0)[0].hz
    assert locked == pytest.approx(linear_modes(robot)[0].hz, rel=1e-3)


def test_a_small_unbalance_peaks_at_the_linear_modes_whichever_way_it_is_swept(
    robot: Robot,
) -> None:
    """A hundredth of the rotor's mass, with T as much heavier, moves T little: the linear limit."""
    values = dict(robot.values)
    light = {name: 0.01 * values[name] for name in ("rotor_mass", "rotor_arm_mass")}
    moved = 0.99 * (values["rotor_mass"] + values["rotor_arm_mass"])
    heavier = {"top_mass": values["top_mass"] + moved}
    gentle = replace(robot, values=values | light | heavier, increments=8)
    bounce = 2 * np.pi * linear_modes(gentle)[1].hz
    responses = driven_response(gentle, [bounce - 0.4, bounce, bounce + 0.4], hold=30.0)
    peaks = [peak for peak in driven_peaks(responses) if peak.axis == "z"]
    assert [peak.direction for peak in peaks] == ["up", "down"]
    assert [peak.speed_rad_s for peak in peaks] == pytest.approx([bounce, bounce], abs=0.01)
    assert peaks[0].amplitude_m == pytest.approx(peaks[1].amplitude_m, rel=0.02)


def test_each_sweep_is_one_motion_and_in_the_order_asked(robot: Robot) -> None:
    up, down = driven_response(robot, [9.0, 8.0, 10.0], hold=4.0, turns=2)
    assert up.speed.tolist() == [8, 9, 10]
    assert down.speed.tolist() == [10, 9, 8]
    (alone,) = driven_response(robot, [8.0], hold=4.0, turns=2, directions=["up"])
    assert up.x[0] == pytest.approx(alone.x[0])
    assert down.x[2] != pytest.approx(alone.x[0], rel=0.01)  # it comes from 9 rad/s, not from rest
    assert np.isfinite([up.x, up.z, up.change, down.x, down.z, down.change]).all()


def test_a_fall_leaves_no_amplitude_and_the_next_speed_starts_from_rest(robot: Robot) -> None:
    heavy = replace(robot, values=dict(robot.values) | {"rotor_mass": 0.1, "rotor_radius": 0.08})
    (up,) = driven_response(heavy, [8.5, 12.0], hold=10.0, directions=["up"])
    assert np.isnan([up.x[0], up.z[0], up.change[0]]).all()
    (alone,) = driven_response(heavy, [12.0], hold=10.0, directions=["up"])
    assert up.z[1] == alone.z[0]


def test_peaks_are_greater_than_both_neighbours_and_a_fall_than_any_amplitude() -> None:
    speed, none = np.arange(7.0), np.zeros(7)
    z = np.array([0.1, 0.3, 0.2, 0.2, np.nan, 0.1, 0.4])
    first, second = driven_peaks([DrivenResponse("up", speed, none, z, none)])
    assert first == ("up", "z", 1.0, 0.3)
    assert second.speed_rad_s == 4.0
    assert np.isnan(second.amplitude_m)


@pytest.mark.parametrize("speeds", [[-5.0, 20.0], [0.0], []])
def test_speeds_that_are_not_positive_are_refused(robot: Robot, speeds: list[float]) -> None:
    with pytest.raises(InputError, match=r"a sweep needs speeds, all of them positive"):
        driven_response(robot, speeds)


def test_too_short_a_time_is_refused_with_how_long_it_must_be(robot: Robot) -> None:
    with pytest.raises(InputError, match=r"^5 s .* twice 5 turns at 4 rad/s; hold for 15\.7 s"):
        driven_response(robot, [8.0, 4.0], hold=5.0)
