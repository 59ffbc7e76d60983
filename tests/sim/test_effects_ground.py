"""Effects of the ground against its equations, on a block and on the robot."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.sim.rigs import MASS, G, block, with_effect
from workbench.motion import FOOT
from workbench.sim import Condition, Robot, applied, compile_model, simulate
from workbench.sim.ground import extend_ground

STANDING = Condition("hop", np.zeros(2))


def test_a_stiffer_ground_sinks_less(robot: Robot) -> None:
    stiff = simulate(with_effect(robot, "ground_stiffness", share=0.4), STANDING)
    assert stiff.sink_m == pytest.approx(MASS * G / (4 * 1.4 * 140), rel=1e-3)


def force_at(robot: Robot, z: float, vz: float) -> float:
    """Return the upward force on the robot's level foot, moving up or down [N]."""
    model = compile_model(applied(robot), "free")
    data = mujoco.MjData(model)
    data.qpos[2], data.qpos[3], data.qvel[2] = z, 1.0, vz
    mujoco.mj_forward(model, data)
    return float(data.userdata.reshape(4, -1)[:, 4].sum())


@pytest.mark.parametrize("vz", [-0.3, 0.01])
def test_ground_damping_scales_what_the_speed_adds(robot: Robot, vz: float) -> None:
    damped = with_effect(robot, "ground_damping", share=0.5)
    assert force_at(damped, -0.004, vz) == pytest.approx(4 * (140 * 0.004 - 1.5 * 15 * vz))


@pytest.mark.parametrize("z", [-0.008, -0.001])
@pytest.mark.parametrize("vz", [-0.3, 0.001])
def test_hunt_crossley_damping_grows_with_the_depth(robot: Robot, z: float, vz: float) -> None:
    deep = with_effect(robot, "ground_hunt_crossley", depth_damping=3000.0)
    expected = 4 * (-140 * z - (15 + 3000 * -z) * vz)
    assert force_at(deep, z, vz) == pytest.approx(expected)


def rebound(speed: float, depth_damping: float) -> float:
    """Return the speed at which a block leaves a ground of Hunt and Crossley, in closed form."""

    def rate(_: float, s: np.ndarray) -> list[float]:
        return [s[1], -G + 4 * (-140 * s[0] - depth_damping * -s[0] * s[1]) / MASS]

    def leaves(t: float, s: np.ndarray) -> float:
        return float(s[0]) if t > 1e-3 else -1.0

    leaves.terminal = True  # type: ignore[attr-defined]
    return float(solve_ivp(rate, (0, 1), [0, -speed], events=leaves, rtol=1e-9).y[1, -1])


@pytest.mark.parametrize("speed", [0.3, 0.9])
def test_a_block_bounces_as_hunt_and_crossley_say(robot: Robot, speed: float) -> None:
    spec = block(dict(robot.values) | {"ground_damping": 0.0}, step=1e-5)
    extend_ground(spec, "depth_damping", 100.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[2] = -speed
    while data.qpos[2] <= 0:
        mujoco.mj_step(model, data)
    assert data.qvel[2] == pytest.approx(rebound(speed, 100.0), rel=0.01)
    assert data.qvel[2] < 0.95 * speed


def breakaway(robot: Robot, side: int) -> float:
    """Return the slope at which a block on this robot's ground starts to slide, as its tangent."""
    tangents = np.arange(0.2, 0.8, 0.02)
    for tangent in tangents:
        model = with_extras(robot, side * float(np.arctan(tangent)))
        data = mujoco.MjData(model)
        data.qpos[2] = -MASS * G / (4 * 140)
        mujoco.mj_step(model, data, nstep=1500)
        if abs(data.qvel[0]) > 0.01:
            return float(tangent)
    raise AssertionError("it never slid")


def with_extras(robot: Robot, slope: float) -> mujoco.MjModel:
    """Return a block on the ground that the robot's effects make of it."""
    changed = applied(robot)
    spec = block(changed.values, slope)
    for edit in changed.edits:
        edit(spec, changed)
    return spec.compile()


def test_more_friction_holds_on_a_steeper_slope(robot: Robot) -> None:
    rough = with_effect(robot, "friction_level", share=0.3)
    assert breakaway(robot, 1) == pytest.approx(0.5, abs=0.021)
    assert breakaway(rough, 1) == pytest.approx(0.65, abs=0.021)


def test_anisotropic_friction_holds_one_way_better(robot: Robot) -> None:
    """On a floor that rises forward the block would slide backward."""
    uneven = with_effect(robot, "friction_anisotropy", share=0.2)
    assert breakaway(uneven, 1) == pytest.approx(0.8 * 0.5, abs=0.021)
    assert breakaway(uneven, -1) == pytest.approx(1.2 * 0.5, abs=0.021)


@pytest.mark.parametrize("side", [1, -1])
def test_a_sliding_block_is_braked_by_the_friction_of_its_direction(
    robot: Robot, side: int
) -> None:
    model = with_extras(with_effect(robot, "friction_anisotropy", share=0.2), 0.0)
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[0] = -MASS * G / (4 * 140), side * 1.0
    mujoco.mj_step(model, data, nstep=400)
    braked = (1.0 - side * data.qvel[0]) / (400 / 4080)
    assert braked == pytest.approx(0.4 * (1 + side * 0.2) * G, rel=1e-3)


def test_better_grip_backward_carries_the_robot_farther(robot: Robot) -> None:
    hop = Condition("hop", np.full(1201, 17.0))
    ways = [
        simulate(with_effect(robot, "friction_anisotropy", share=share), hop).motion[FOOT[0]][-1]
        for share in (0.3, 0.0, -0.3)
    ]
    print(f"distance with friction 30 % higher forward, equal, lower: {ways}")
    assert ways[0] < ways[1] < ways[2]


@pytest.mark.parametrize(("share", "distance"), [(0.0, 0.1627), (1.0, 0.1022)])
def test_both_readings_of_the_wait_mode_go_as_far_as_the_reference(
    robot: Robot, share: float, distance: float
) -> None:
    """Ten seconds at 17 rad/s, of `benchmarks.contact`: sticking exact, events located [m]."""
    hop = Condition("hop", np.full(1201, 17.0))
    there = simulate(with_effect(robot, "friction_wait", share=share), hop).motion[FOOT[0]]
    print(f"share {share:g}: {there[-1] - there[0]:.4f} m, reference {distance:.4f} m")
    assert there[-1] - there[0] == pytest.approx(distance, rel=0.05)


@pytest.mark.parametrize("pull", [0.0, 0.05])
def test_a_sticking_sole_is_torn_off_by_the_weight_and_four_pulls(
    robot: Robot, pull: float
) -> None:
    model = with_extras(with_effect(robot, "sole_adhesion", pull=pull), 0.0)
    data = mujoco.MjData(model)
    data.qpos[2] = -MASS * G / (4 * 140)
    lift = 0.0
    while data.qpos[2] < 0.002:
        lift = 0.05 * data.time  # [N] slow beside the ground's 0.1 s
        data.xfrc_applied[1, 2] = MASS * G - 0.1 + lift
        mujoco.mj_step(model, data)
    assert lift - 0.1 == pytest.approx(4 * pull, abs=0.02)


def test_a_torn_sole_sticks_again_only_where_it_touches(robot: Robot) -> None:
    model = with_extras(with_effect(robot, "sole_adhesion", pull=0.5), 0.0)
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[2] = 0.001, -0.1
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[2] == 0.0  # not yet, though within the reach of a stuck corner
    mujoco.mj_step(model, data, nstep=60)
    data.qpos[2], data.qvel[2] = 0.001, 0.0
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[2] == pytest.approx(-4 * 140 * 0.001)


def test_a_slope_pulls_the_robot_down_it(robot: Robot) -> None:
    hop = Condition("hop", np.full(1201, 17.0))
    ways = [
        simulate(with_effect(robot, "ground_slope", slope=slope), hop).motion[FOOT[0]][-1]
        for slope in (0.03, -0.03)
    ]
    assert ways[0] < ways[1]
