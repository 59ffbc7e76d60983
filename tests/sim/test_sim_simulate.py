from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.motion import (
    FOOT,
    ROTOR,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    TOP,
    Summary,
    position,
    summarize,
)
from workbench.schemas import Mode
from workbench.sim import Condition, Robot, Simulation, gait, sample_times, simulate, simulate_all

REST = 0.6


def at(omega: float, duration: float = 10.0, mode: Mode = "hop") -> Condition:
    return Condition(mode, np.full(len(sample_times(duration)), omega), rest=REST)


def run(robot: Robot, omega: float, duration: float = 10.0, mode: Mode = "hop") -> Simulation:
    return simulate(robot, at(omega, duration, mode))


def summary(robot: Robot, omega: float) -> Summary:
    return summarize(run(robot, omega).motion, 10.0)


def test_it_hops_forward_at_17_rad_s_by_the_thesis_order(robot: Robot) -> None:
    found = summary(robot, 17.0)
    assert 0.05 < found.distance_m < 0.6  # fig. 6.1: about 0.2 m
    assert found.hop_height_m > 0.005
    assert found.speed_rad_s == pytest.approx(17, rel=1e-3)


def test_it_goes_nowhere_when_the_rotor_turns_backward(robot: Robot) -> None:
    assert abs(summary(robot, -17.0).distance_m) < 0.02


def test_more_friction_than_0_8_holds_it_in_place(robot: Robot) -> None:
    rough = replace(robot, values=dict(robot.values) | {"friction_slide": 0.8, "friction_stick": 1})
    assert abs(summary(rough, 17.0).distance_m) < 0.3 * summary(robot, 17.0).distance_m


def test_at_rest_it_stays_at_rest(robot: Robot) -> None:
    motion = run(robot, 0.0, 5.0).motion
    for point in (FOOT, TOP, ROTOR):
        assert np.ptp(position(motion, point), axis=0).max() < 1e-6


def test_gravity_lowers_t_by_about_five_centimetres(robot: Robot) -> None:
    top = position(run(robot, 0.0, 0.5).motion, TOP)[0]
    assert 0.3265 - top[2] == pytest.approx(0.05, abs=0.006)


def test_the_motion_stays_in_the_hopping_plane(robot: Robot) -> None:
    motion = run(robot, 17.0).motion
    for point in (FOOT, TOP, ROTOR):
        assert np.abs(position(motion, point)[:, 1]).max() < 1e-6


def test_the_sampling_is_120_hz_and_the_speed_is_the_motor_s(robot: Robot) -> None:
    motion = run(robot, 17.0, 4.0).motion
    assert np.diff(motion.times) == pytest.approx(1 / 120)
    driven = motion.between(1, 4)
    assert np.mean(driven[ROTOR_SPEED]) == pytest.approx(17, abs=0.1)


def test_the_same_input_gives_the_same_bits(robot: Robot) -> None:
    first, second = run(robot, 17.0, 3.0).motion, run(robot, 17.0, 3.0).motion
    assert np.array_equal(first.values, second.values)


def test_a_loaded_shape_stands_with_its_listed_angles(robot: Robot) -> None:
    loaded = replace(robot, state="loaded")
    motion = run(loaded, 0.0, 0.5).motion
    standing = [motion[f"hinge_{k}_rad"][0] for k in range(16)]
    assert standing == pytest.approx(list(robot.angles), abs=1e-4)


def test_a_clamped_foot_does_not_move_and_t_does(robot: Robot) -> None:
    result = run(robot, 14.0, 5.0, "clamped")
    assert not position(result.motion, FOOT).any()
    assert np.ptp(result.motion[TOP[2]]) > 0.02
    assert result.outcome == "completed"


def test_a_fall_is_an_outcome_and_ends_the_motion(robot: Robot) -> None:
    heavy = replace(robot, values=dict(robot.values) | {"rotor_mass": 0.08, "rotor_radius": 0.05})
    result = run(heavy, 19.0)
    assert result.outcome == "fell"
    assert result.motion.times[-1] < 9
    assert result.motion[TOP[2]].min() - result.sink_m >= 0.05


def test_a_robot_that_cannot_stand_is_refused_with_what_was_seen(robot: Robot) -> None:
    leaning = replace(robot, angles=(-0.5, *robot.angles[1:]))
    with pytest.raises(InputError, match=r"does not stand: with T at z = -?\d+\.\d+ m it finds no"):
        run(leaning, 17.0)


def test_a_blow_up_is_an_outcome(robot: Robot) -> None:
    # the ground's dampers are explicit: more than mass over step and the foot bounces ever higher
    hard = replace(robot, values=dict(robot.values) | {"ground_damping": 2000.0})
    result = run(hard, 17.0, 2.0)
    assert result.outcome == "diverged"
    assert np.isfinite(result.motion.values).all()


def test_alone_or_in_a_batch_the_bits_are_the_same(robot: Robot) -> None:
    other = replace(robot, angles=(-2.5, *robot.angles[1:]))
    finer = replace(robot, increments=32)
    jobs = [(r, at(w, 2.0)) for r in (robot, other, finer) for w in (16.0, 18.0)]
    jobs.append((robot, at(14.0, 1.0, "clamped")))
    jobs += [(robot, replace(at(w, 1.0), drive=d)) for d, w in (("voltage", 4.0), ("torque", 0.01))]
    alone = [simulate(*job) for job in jobs]
    for threads in (1, 2, 3):
        for one, many in zip(alone, simulate_all(jobs, threads), strict=True):
            assert np.array_equal(one.motion.values, many.motion.values)


def test_the_planar_robot_hops_as_the_spatial_one(robot: Robot) -> None:
    spatial, planar = (
        run(replace(robot, planar=planar), 17.0, 4.0).motion for planar in (False, True)
    )
    for point in (FOOT, TOP):
        apart = position(spatial, point) - position(planar, point)
        assert np.abs(apart).max() < 1e-6


def test_in_decay_t_is_released_from_where_it_was_pulled(robot: Robot) -> None:
    pulled = Condition("decay", np.zeros(600), rest=REST, pull=0.39)
    motion = simulate(robot, pulled).motion
    level = simulate(robot, replace(pulled, pull=0.0)).motion[TOP[0]][0]
    before, after = motion.between(-REST, 0), motion.between(3.0, 5.0)
    assert before[TOP[0]] == pytest.approx(before[TOP[0]][0])
    assert before[TOP[0]][0] - level > 0.01
    swing = after[TOP[0]] - level
    assert 0.001 < np.abs(swing).max() < before[TOP[0]][0] - level
    assert np.diff(np.unwrap(motion[ROTOR_ANGLE])).max() < 0.1


def test_in_drop_the_robot_falls_by_its_height_and_comes_to_rest(robot: Robot) -> None:
    result = simulate(robot, Condition("drop", np.zeros(900), rest=REST, height=0.02))
    z, times = result.motion[FOOT[2]], result.motion.times
    falling = (times > 0) & (times < 0.04)
    fall = -0.5 * 9.81 * times[falling] ** 2
    assert (z[falling] < fall).all()  # the beam, bent by the weight, stretches and pushes the foot
    assert z[-1] == pytest.approx(-0.02 - 0.0045, abs=0.0005)


def test_gait_counts_hops_and_the_work_of_the_motor(robot: Robot) -> None:
    result = run(robot, 17.0)
    found = gait(result, 10.0)
    assert 20 <= found.hops <= 28  # one a turn at 2.7 Hz, once it has started
    assert found.stride_m * found.hops == pytest.approx(result.motion[FOOT[0]][-1], rel=0.01)
    assert 0 < found.slip_per_hop_m < 0.02
    assert 0.01 < found.mean_power_W < 1.0
    speed = result.motion[FOOT[0]][-1] / 10
    assert found.cost_of_transport == pytest.approx(
        found.mean_power_W / (0.2574 * 9.81 * speed), rel=0.01
    )
    assert np.isnan(gait(run(robot, 14.0, 2.0, "clamped"), 2.0).cost_of_transport)


def test_a_blow_up_leaves_no_log_file_of_the_engine(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    test_a_blow_up_is_an_outcome(robot)
    assert list(tmp_path.iterdir()) == []


def test_energy_is_recorded_on_request_and_decays_with_the_ring_down(robot: Robot) -> None:
    pulled = Condition("decay", np.zeros(720), pull=0.39, energy=True)
    motion = simulate(robot, pulled).motion
    total = motion["potential_energy_J"] + motion["kinetic_energy_J"]
    assert motion["kinetic_energy_J"][0] == 0
    assert motion["kinetic_energy_J"].max() > 0.5 * (total[0] - total.min())
    assert (np.diff(total[::12]) < 1e-9).all()
    assert "potential_energy_J" not in simulate(robot, replace(pulled, energy=False)).motion
