"""Effects of the structure against statics and closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.sim.rigs import PENDULUM_RATE, bends, moments, pendulum, resting, with_effect
from workbench.motion import TOP
from workbench.sim import (
    Condition,
    Robot,
    Statics,
    applied,
    compile_model,
    linear_modes,
    moving_dofs,
    settle,
    simulate,
    unloaded,
)

PULL = 0.5  # [N] forward on T
NEAR_FOOT, MIDDLE, NEAR_TOP = slice(1, 6), slice(6, 11), slice(11, 16)


def carried(robot: Robot, pull: float = PULL) -> tuple[np.ndarray, np.ndarray]:
    """Return bends and moments of all hinges at rest, pulled."""
    state = resting(robot, pull)
    return bends(state, robot), moments(state, pull)


def test_without_effects_every_hinge_carries_its_moment(robot: Robot) -> None:
    bend, moment = carried(robot)
    assert bend * ([12.0] + [9.5] * 15) == pytest.approx(moment, abs=1e-9)
    assert moment.min() > 0.01


def test_hinge_stiffness_is_that_of_the_strip_alone(robot: Robot) -> None:
    bend, moment = carried(with_effect(robot, "hinge_stiffness", share=0.2))
    assert moment / bend == pytest.approx([12.0] + [1.2 * 9.5] * 15)


def test_root_stiffness_is_that_of_the_foot_joint_alone(robot: Robot) -> None:
    bend, moment = carried(with_effect(robot, "root_stiffness", share=-0.3))
    assert moment / bend == pytest.approx([0.7 * 12.0] + [9.5] * 15)


def test_a_local_loss_bends_its_third_more(robot: Robot) -> None:
    softer = with_effect(robot, "local_stiffness_loss", middle=0.4, near_top=0.1)
    bend, moment = carried(softer)
    stiffness = np.full(16, 9.5)
    stiffness[0], stiffness[MIDDLE], stiffness[NEAR_TOP] = 12.0, 0.6 * 9.5, 0.9 * 9.5
    assert moment / bend == pytest.approx(stiffness)


@pytest.mark.parametrize("increments", [16, 20, 33, 48])
def test_a_local_loss_adds_its_compliance_in_any_chain(robot: Robot, increments: int) -> None:
    chain = replace(robot, increments=increments)
    softer = with_effect(chain, "local_stiffness_loss", near_foot=0.2, middle=-0.5, near_top=0.5)
    sums = []
    for r in (softer, chain):
        model = compile_model(applied(r), "fixed")
        sums.append((1 / model.jnt_stiffness[model.jnt_stiffness > 0]).sum())
    added = 5 / 9.5 * (1 / 0.8 + 1 / 1.5 + 1 / 0.5 - 3)
    assert sums[0] - sums[1] == pytest.approx(added)


@pytest.mark.parametrize("increments", [32, 48])
@pytest.mark.parametrize("part", ["near_foot", "middle", "near_top"])
def test_a_local_loss_is_the_same_strip_in_any_chain(
    robot: Robot, increments: int, part: str
) -> None:
    """How far T is moved by the loss agrees to what chains of these increments differ in."""

    def shift(chain: Robot) -> np.ndarray:
        softer = with_effect(chain, "local_stiffness_loss", **{part: 0.3})
        places = [resting(r, PULL)[1].body("top").xpos for r in (softer, chain)]
        return places[0] - places[1]

    apart = shift(replace(robot, increments=increments)) - shift(robot)
    assert np.linalg.norm(apart) < 0.03 * np.linalg.norm(shift(robot))


def test_a_cubic_term_carries_with_the_cube_of_the_bend(robot: Robot) -> None:
    bend, moment = carried(with_effect(robot, "hinge_cubic_stiffness", k3=2000.0))
    stiffness = np.array([12.0] + [9.5] * 15)
    cubic = np.array([0.0] + [2000.0] * 15)
    assert (cubic * bend**3)[8] > 0.05 * moment[8]
    assert stiffness * bend + cubic * bend**3 == pytest.approx(moment, abs=1e-9)


def test_a_cubic_term_is_the_same_strip_in_a_finer_chain(robot: Robot) -> None:
    fine = replace(robot, increments=32)
    shifts = []
    for chain in (robot, fine):
        stiff = with_effect(chain, "hinge_cubic_stiffness", k3=2000.0)
        x = [resting(r, PULL)[1].body("top").xpos[0] for r in (stiff, chain)]
        shifts.append(x[0] - x[1])
    assert shifts[1] == pytest.approx(shifts[0], rel=0.03)


def frequency(robot: Robot, pull: float) -> float:
    """Return how fast T rings about its rest in the first ten swings, a ring-down's mean [Hz]."""
    condition = Condition("decay", np.zeros(480), pull=pull)
    away = (
        simulate(robot, condition).motion[TOP[0]]
        - simulate(robot, replace(condition, pull=0.0)).motion[TOP[0]][0]
    )
    crossing = np.flatnonzero((away[:-1] > 0) & (away[1:] <= 0))
    times = crossing + away[crossing] / (away[crossing] - away[crossing + 1])
    return float((len(times) - 1) / (times[-1] - times[0]) * 120)


def test_a_cubic_term_raises_the_frequency_with_the_square_of_the_amplitude(robot: Robot) -> None:
    """Straight up and without weight the strip bends evenly to both sides, as nothing else does."""
    level = replace(robot, values=dict(robot.values) | {"gravity": 1e-3})
    straight = replace(level, angles=(-np.pi / 2, *[0.0] * 15))
    stiff = with_effect(straight, "hinge_cubic_stiffness", k3=1000.0)
    rise = [frequency(stiff, pull) - frequency(straight, pull) for pull in (0.2, 0.4)]
    print(f"rise of the frequency by pulls of 0.2 and 0.4 N: {rise} Hz")
    assert rise[0] > 0.001
    assert rise[1] / rise[0] == pytest.approx(4.0, rel=0.1)


def test_play_frees_the_foot_joint_within_its_gap(robot: Robot) -> None:
    bend, moment = carried(with_effect(robot, "root_play", gap=0.004))
    assert (bend[0] - 0.004) * 12.0 == pytest.approx(moment[0], abs=1e-9)
    assert bend[1:] * 9.5 == pytest.approx(moment[1:], abs=1e-9)


@pytest.mark.parametrize("gap", [1e-6, 1e-3, 5e-3, 0.02])
def test_with_play_the_robot_leans_to_one_end_of_the_gap(robot: Robot, gap: float) -> None:
    bend, moment = carried(with_effect(robot, "root_play", gap=gap), 0.0)
    beyond = bend[0] - np.sign(bend[0]) * gap
    assert beyond * bend[0] > 0
    assert beyond * 12.0 == pytest.approx(moment[0], abs=1e-9)


def test_a_joint_that_rests_at_the_edge_of_its_play_is_at_rest(robot: Robot) -> None:
    """Differences across the edge would see half a spring; found with a robot of the bank."""
    drawn = {
        "beam_mass": 0.05618008964234721, "hinge_stiffness": 9.161397158846155,
        "root_stiffness": 13.810362978866461, "top_mass": 0.09030296623370995,
        "rotor_mass": 0.033186907738418515, "rotor_radius": 0.03515497142582642,
        "foot_mass": 0.07435525722179336,
    }  # fmt: skip
    own = replace(robot, values={**robot.values, **drawn})
    edge = applied(with_effect(own, "root_play", gap=0.0008039834733717977))
    model, data = settle(edge, "fixed", 1.5846887566254118)
    assert data.body("top").xpos[2] == pytest.approx(0.273, abs=0.001)
    beyond = abs(data.qpos[0] - model.qpos_spring[0]) - 0.0008039834733717977
    assert 0 < beyond < 1e-6
    free = moving_dofs(model, "fixed")
    statics = Statics(model, data, free)
    here = statics.balance().stiffness
    data.qpos[0] += 1e-5 * np.sign(data.qpos[0] - model.qpos_spring[0])
    assert here == pytest.approx(statics.balance().stiffness, rel=1e-3, abs=1e-3)


def test_a_joint_that_leaves_the_edge_of_its_play_inwards_finds_the_other(robot: Robot) -> None:
    """A hair within the edge its spring does not push back; found with a robot of the bank."""
    own = replace(
        robot, increments=32, values={**robot.values, "rotor_radius": 0.03505778267216107}
    )
    _, data = settle(applied(with_effect(own, "root_play", gap=0.005)), "fixed", 1.6441901416936016)
    assert data.qpos[0] - own.angles[0] < -0.005, "it leans the way that its weight pulls it"


@pytest.mark.parametrize("amplitude", [0.011, 0.02, 0.1])
def test_play_lowers_the_frequency_at_small_amplitude(amplitude: float) -> None:
    """In closed form: half a free swing on either side, the gap crossed at the speed between."""
    gap = 0.01
    swing = pendulum({"root_gap": gap}, amplitude, 6.0)
    crossing = np.flatnonzero((swing[:-1] > 0) & (swing[1:] <= 0))
    times = 1e-4 * (crossing + swing[crossing] / (swing[crossing] - swing[crossing + 1]))
    period = 2 * np.pi / PENDULUM_RATE + 4 * gap / (PENDULUM_RATE * (amplitude - gap))
    assert np.diff(times).mean() == pytest.approx(period, rel=1e-3)


def test_a_drifted_strip_rests_at_other_angles(robot: Robot) -> None:
    bend, moment = carried(with_effect(robot, "rest_shape_drift", root=0.01, bend=0.06))
    own = bend - np.array([0.01] + [0.004] * 15)
    assert own * ([12.0] + [9.5] * 15) == pytest.approx(moment, abs=1e-9)


def test_a_shape_listed_standing_drifts_as_well(robot: Robot) -> None:
    """Its free strip is that of before, and the drift on top."""
    loaded = replace(robot, state="loaded")
    drifted = unloaded(replace(loaded, drift=(0.01,) + (0.002,) * 15))
    assert np.subtract(drifted.angles, unloaded(loaded).angles) == pytest.approx(
        [0.01] + [0.002] * 15
    )
    assert unloaded(drifted) == drifted


def test_a_turned_root_moves_the_place_and_hardly_the_frequency(robot: Robot) -> None:
    drifted = with_effect(robot, "rest_shape_drift", root=0.02)
    shift = resting(drifted)[1].body("top").xpos - resting(robot)[1].body("top").xpos
    rates = [linear_modes(r, count=1)[0].hz for r in (drifted, robot)]
    print(f"T moves by {shift} m, the frequency from {rates[1]} to {rates[0]} Hz")
    assert np.hypot(shift[0], shift[2]) > 5e-3
    assert rates[0] == pytest.approx(rates[1], rel=5e-3)
