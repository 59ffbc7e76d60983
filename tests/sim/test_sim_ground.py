"""The ground law against eq. 3.1 to 3.3, written out a second time with MuJoCo's own jacobians."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from workbench.motion import TOP, position
from workbench.sim import (
    Condition,
    Robot,
    compile_model,
    install_force_laws,
    sample_times,
    settle,
    simulate_all,
)
from workbench.sim.ground import LOCKED, LOOSE, UNLOCKED, WAIT, _friction, corner_records

CORNERS = np.array([[x, y, 0] for x in (0.1375, -0.1375) for y in (0.124, -0.124)])


def placed(
    robot: Robot, qpos: np.ndarray, qvel: np.ndarray
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = compile_model(robot, "free")
    data = mujoco.MjData(model)
    data.qpos[:7], data.qvel[:6] = qpos, qvel
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("seed", range(8))
def test_forces_at_every_corner_follow_the_equations(robot: Robot, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = rng.normal(0, 0.05, 3)
    quat = np.empty(4)
    mujoco.mju_axisAngle2Quat(quat, turn / np.linalg.norm(turn), float(np.linalg.norm(turn)))
    qvel = np.concatenate([rng.normal([0.5, 0, -0.2], 0.1), rng.normal(0, 0.5, 3)])
    qpos = np.concatenate([[0.3, 0.01, -0.005], quat])
    model, data = placed(robot, qpos, qvel)
    expected, foot = np.zeros(model.nv), model.body("foot").id
    for corner in CORNERS:
        point = data.xpos[foot] + data.xmat[foot].reshape(3, 3) @ corner
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, point, foot)
        velocity = jacobian @ data.qvel
        normal = max(0.0, -140 * point[2] - 15 * velocity[2]) if point[2] <= 0 else 0.0
        side = -20 * (point[1] - corner[1]) - 8 * velocity[1] if point[2] <= 0 else 0.0
        assert abs(velocity[0]) > 0.01  # all of them slide
        force = [-0.4 * normal * np.sign(velocity[0]), side, normal]
        expected += jacobian.T @ force
    assert data.qfrc_passive[:6] == pytest.approx(expected[:6], abs=1e-12)


def test_no_force_above_the_ground_and_none_that_pulls(robot: Robot) -> None:
    level = np.array([0, 0, 1.001 * robot.step, 1, 0, 0, 0])  # lands within the next step
    _, data = placed(robot, level, np.array([0.3, 0.3, -1, 0, 0, 0]))
    assert not data.qfrc_passive[:6].any()
    level[2] = -0.002
    _, data = placed(robot, level, np.array([0, 0, 1.0, 0, 0, 0]))
    assert corner_records(data.userdata)[:, 4].tolist() == [0, 0, 0, 0]


def test_a_corner_that_lands_has_its_share_of_the_step(robot: Robot) -> None:
    falls = np.array([0.3, 0, -0.5, 0, 0, 0])
    for gone in (0.0, 0.25, 0.999):
        level = np.array([0, 0, 0.5 * robot.step * gone, 1, 0, 0, 0])
        _, data = placed(robot, level, falls)
        corners = corner_records(data.userdata)
        assert corners[:, 4] == pytest.approx(np.full(4, (1 - gone) * 15 * 0.5))
        assert corners[:, 2] == pytest.approx(-0.4 * corners[:, 4])


def greatest_jump(robot: Robot, speed: float) -> float:
    """Return by how much T's place after 3 s jumps at most [m] while a hinge grows stiffer.

    A share of 2e-6 more stiffness moves T by about 1 um. Where corners land, lock and unlock at the
    end of a step it jumps by 76, 19 and 174 um at 17, 18 and 19 rad/s.
    """
    stiffness = robot.values["hinge_stiffness"] * (1 + 2e-6 * np.arange(31))
    robots = [
        replace(robot, planar=True, values=dict(robot.values) | {"hinge_stiffness": float(k)})
        for k in stiffness
    ]
    command = np.minimum(sample_times(3.0) / 0.5, 1) * speed
    done = simulate_all([(one, Condition("hop", command)) for one in robots])
    places = np.array([position(one.motion, TOP)[-1, 0] for one in done])
    return float(np.abs(np.diff(places)).max())


def test_a_hop_changes_as_smoothly_as_its_robot(robot: Robot) -> None:
    jump = greatest_jump(robot, 17.0)
    print(f"greatest jump {1e6 * jump:.1f} um")
    assert jump < 10e-6


@pytest.mark.long
def test_so_do_hops_of_most_speeds(robot: Robot) -> None:
    """At some a corner just grips or just does not: 4 to 6 of 21 jump by 10 to 80 um."""
    jumps = np.array([greatest_jump(robot, float(speed)) for speed in np.linspace(16, 20, 21)])
    print(f"greatest jumps {np.round(1e6 * jumps, 1)} um")
    assert np.median(jumps) < 3e-6
    assert np.mean(jumps < 10e-6) > 2 / 3


def test_the_standing_robot_sinks_as_eq_3_1_says(robot: Robot) -> None:
    _, data = settle(robot, "free", np.pi / 2)
    corners = corner_records(data.userdata)
    assert -data.qpos[2] == pytest.approx(0.2574 * 9.81 / (4 * 140), rel=1e-3)
    assert corners[:, 4].sum() == pytest.approx(0.2574 * 9.81, rel=1e-6)
    assert set(corners[:, 0]) == {LOCKED}


PARAMETERS = np.array([0, 0, 0, 140, 15, 20, 8, 0.4, 0.5, 0.01, 2e4, 30.0, 0, 0, 0, 0, 0, 1e-4])


def corner(state: float, speed: float, anchor: float = 0.0) -> np.ndarray:
    """A corner that touched the ground a step ago, at a speed."""
    return np.array([state, anchor, 0, 0, 1.0, 1, speed])


@pytest.mark.parametrize(
    ("start", "x", "vx", "fz", "force", "end"),
    [
        (UNLOCKED, 0, 0.02, 1.0, -0.4, UNLOCKED),  # slides: kinetic friction against the motion
        (UNLOCKED, 0, -0.02, 1.0, 0.4, UNLOCKED),
        (UNLOCKED, 0.7, 0.005, 1.0, -0.15, LOCKED),  # below v_th it locks where it is
        (LOCKED, 1e-5, 0.0, 1.0, -0.2, LOCKED),  # held at its anchor
        (LOCKED, 1e-3, 0.0, 1.0, -0.5, WAIT),  # more than static friction: waits at the limit
        (WAIT, 1e-3, 0.005, 1.0, -0.5, WAIT),  # does not move faster than it did: it may hold yet
        (WAIT, 1e-5, 0.0, 1.0, -0.2, LOCKED),  # static friction suffices again
        (LOOSE, 1e-3, 0.005, 1.0, -0.4, LOOSE),  # slides on, too slow to be locked when it slows
        (LOOSE, 1e-3, 0.02, 1.0, -0.4, UNLOCKED),  # from now on it may
        (LOOSE, 1e-5, -0.001, 1.0, -0.17, LOCKED),  # turned back
        (LOCKED, 0.5, 0.5, 0.0, 0.0, UNLOCKED),  # in the air
    ],
)
def test_stick_slip_goes_through_the_states_of_figure_3_4(
    start: float, x: float, vx: float, fz: float, force: float, end: float
) -> None:
    state = corner(start, vx)
    assert _friction(PARAMETERS, state, x, vx, fz) == pytest.approx(force)
    assert state[0] == end


def test_a_change_of_state_counts_from_where_it_was_in_the_step() -> None:
    """Half a step ago a corner fell below v_th, or came to it: half a step's force is made up."""
    state = corner(UNLOCKED, 0.012)
    force = _friction(PARAMETERS, state, 0.7, 0.008, 1.0)
    assert (state[0], state[1]) == (LOCKED, pytest.approx(0.7 - 0.008 * 0.5e-4))
    held = -2e4 * 0.008 * 0.5e-4 - 30.0 * 0.008
    assert force == pytest.approx(held + 0.5 * (held - -0.4))
    state = corner(WAIT, 0.002)  # breaks loose: it slides since a step ago
    assert _friction(PARAMETERS, state, 1e-3, 0.003, 1.0) == pytest.approx(-0.4 + (0.5 - 0.4))
    assert (state[0], state[1]) == (LOOSE, pytest.approx(1e-3 - 0.4 / 2e4))
    state = corner(UNLOCKED, 0.012)
    assert _friction(PARAMETERS, state, 0.7, 0.012, 0.0) == 0.0  # in the air
    assert _friction(PARAMETERS, state, 0.7, 0.008, 1.0) == pytest.approx(-30.0 * 0.008)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_corner_turns_back_within_a_step(share: float) -> None:
    """A mass of 10 g slides backwards, pushed forward by 20 N against 0.4 N of friction."""
    mass, push, friction, step = 0.01, 20.0, 0.4, float(PARAMETERS[17])
    state, x = corner(UNLOCKED, 0.0), 0.0
    vx = -(1 + share) * step * (push + friction) / mass
    for _ in range(6):
        force = _friction(PARAMETERS, state, x, vx, 1.0)
        vx += step * (push + force) / mass
        x += step * vx
    # a force that held for a part of a step is made up for in the next one
    assert vx == pytest.approx((6 - 1 - share) * step * (push - friction) / mass, rel=1e-9)


def test_a_corner_that_broke_loose_may_be_braked_by_static_friction() -> None:
    braked = PARAMETERS.copy()
    braked[16] = 1.0
    assert _friction(braked, corner(LOOSE, 0.005), 1e-3, 0.006, 1.0) == pytest.approx(-0.5)
    state = corner(LOOSE, 0.005)
    assert _friction(braked, state, 1e-3, 0.015, 1.0) == pytest.approx(-0.4 + 0.5 * 0.1)
    assert state[0] == UNLOCKED


def pushed(robot: Robot, share: float, seconds: float) -> float:
    """Return the foot's mean speed after a push of a share of the breakaway force [m/s]."""
    model, data = settle(robot, "free", np.pi / 2)
    data.xfrc_applied[model.body("foot").id, 0] = share * 0.5 * 0.2574 * 9.81
    mujoco.mj_step(model, data, nstep=1000)  # the beam swings at first
    start = data.qpos[0]
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return float(data.qpos[0] - start) / seconds


def test_sticking_holds_and_breaks_away(robot: Robot) -> None:
    stiff = replace(robot, values=dict(robot.values) | {"hinge_damping": 0.5, "root_damping": 0.5})
    assert abs(pushed(stiff, 0.5, 5.0)) < 1e-4  # 0.1 mm/s at half the breakaway force
    # at 0.9 the beam, which the push swings, breaks it loose: sliding friction is 0.8 of static
    assert abs(pushed(stiff, 0.85, 5.0)) < 1e-4
    assert pushed(stiff, 1.3, 1.0) > 0.1


def test_other_models_are_left_alone() -> None:
    install_force_laws()
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><custom><numeric name='a' data='{' '.join(map(str, range(1, 31)))}'/></custom>"
        "<worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.qpos[2] = -1.0
    mujoco.mj_forward(model, data)
    assert not data.qfrc_passive.any()
