"""Effects of masses against weights, levers and the engine's own jacobian."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

from tests.sim.rigs import DOWN, MASS, G, bends, resting, with_effect
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
)
from workbench.sim.statics import displace

STANDING = Condition("hop", np.zeros(2))


@pytest.mark.parametrize("name", ["top_mass", "foot_mass"])
def test_an_added_mass_is_weighed_and_sinks(robot: Robot, name: str) -> None:
    found = simulate(with_effect(robot, name, mass=0.01), STANDING)
    assert found.weight_N == pytest.approx((MASS + 0.01) * G)
    sunk = found.sink_m - simulate(robot, STANDING).sink_m
    assert sunk == pytest.approx(0.01 * G / (4 * 140), rel=0.02)


def test_a_mass_on_t_lowers_it_by_its_weight_times_the_compliance(robot: Robot) -> None:
    model, data = resting(robot)
    dofs = moving_dofs(model, "fixed")
    place = data.body("top").xpos.copy()
    stiffness = Statics(model, data, dofs).balance().stiffness
    mujoco.mj_forward(model, data)
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, place, model.body("top").id)
    turn = np.asarray(np.linalg.solve(stiffness, jacobian[2, dofs] * -1e-4 * G), dtype=float)
    displace(model, data, dofs, turn)
    mujoco.mj_forward(model, data)
    expected = data.body("top").xpos - place
    heavier = resting(with_effect(robot, "top_mass", mass=1e-4))[1].body("top").xpos - place
    assert heavier[2] < 0
    assert heavier == pytest.approx(expected, rel=0.01)


def test_a_mass_on_t_lowers_the_frequency_by_rayleigh_s_quotient(robot: Robot) -> None:
    """Without weight, so that the pose stays; the mode is from the engine's own matrices."""
    level = replace(robot, values=dict(robot.values) | {"gravity": 1e-3})
    light, heavy = (
        linear_modes(r, rotor_angle=DOWN, count=1)[0].hz
        for r in (level, with_effect(level, "top_mass", mass=1e-4))
    )
    model, data = resting(level)
    dofs = moving_dofs(model, "fixed")
    stiffness = Statics(model, data, dofs, rotor_keeps="top").balance().stiffness
    mujoco.mj_forward(model, data)
    mass, jacobian = np.zeros((model.nv, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_fullM(model, data, mass)
    top = model.body("top").id
    mujoco.mj_jac(model, data, jacobian, None, data.xpos[top], top)
    shape = eigh((stiffness + stiffness.T) / 2, mass[np.ix_(dofs, dofs)])[1][:, 0]
    carried = float(np.sum((jacobian[:, dofs] @ shape) ** 2))  # of a modal mass of 1
    assert heavy / light - 1 == pytest.approx(-1e-4 * carried / 2, rel=0.01)


def test_an_eccentric_foot_tips_by_its_moment(robot: Robot) -> None:
    """The corners' springs take it, and the weight above that leans with the foot."""
    pitches = []
    for r in (robot, with_effect(robot, "foot_cg", forward=0.01)):
        data = settle(applied(r), "free", DOWN)[1]
        pitches.append(2 * np.arcsin(data.qpos[5]))
    springs = 4 * 140 * (0.275 / 2) ** 2
    tipped = pitches[1] - pitches[0]
    assert tipped > 0  # nose down
    assert tipped == pytest.approx(0.073 * G * 0.01 / (springs - MASS * G * 0.2), rel=0.05)


def test_the_ground_carries_a_foot_whose_weight_is_elsewhere(robot: Robot) -> None:
    data = settle(applied(with_effect(robot, "foot_cg", forward=0.01)), "free", DOWN)[1]
    assert data.qpos[:2] == pytest.approx([0, 0], abs=1e-12)
    assert data.userdata.reshape(4, -1)[:, 4].sum() == pytest.approx(MASS * G, rel=1e-6)


def test_an_unbalanced_rotor_loads_the_beam_by_its_moment(robot: Robot) -> None:
    """Ahead of T and behind it: half the difference is M_R L_R g, arm and eccentric mass.

    T's own lever is an increment of the beam, which leans a little the other way.
    """

    def moment(r: Robot) -> float:
        ahead, behind = (bends(resting(r, angle=angle), r)[15] for angle in (0.0, np.pi))
        return 9.5 * float(ahead - behind) / 2

    nominal = (0.0334 * 0.035 + 0.008 * 0.035 / 2) * G
    assert moment(robot) == pytest.approx(nominal, rel=0.1)
    unbalanced = with_effect(robot, "rotor_unbalance", share=0.1)
    assert moment(unbalanced) / moment(robot) == pytest.approx(1.1, rel=1e-3)


def test_the_cameras_see_an_unbalanced_rotor_where_it_was(robot: Robot) -> None:
    unbalanced = applied(with_effect(robot, "rotor_unbalance", share=0.1))
    for r in (robot, unbalanced, replace(unbalanced, planar=True)):
        assert compile_model(r, "free").site("rotor").pos == pytest.approx([0.035, 0, 0])
