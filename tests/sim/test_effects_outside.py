"""What pulls on T from outside, and the compiled forces on it against the engine's jacobian."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tests.sim.rigs import resting, with_effect
from workbench.sim import Robot, applied, compile_model, linear_modes


@pytest.mark.parametrize("layout", ["fixed", "free", "planar"])
def test_forces_at_t_act_as_the_jacobian_says(robot: Robot, layout: str) -> None:
    """Drag, pull and spring together, on a tilted robot in the air that moves and turns."""
    pulled = with_effect(with_effect(robot, "air_drag", c=0.3), "tether", stiffness=2.0, pull=0.05)
    foot = "fixed" if layout == "fixed" else "free"
    rest = resting(robot)[1].body("top").xpos[0]
    passive, expected = [], np.zeros(0)
    for r in (pulled, robot):
        model = compile_model(replace(applied(r), planar=layout == "planar"), foot)
        data = mujoco.MjData(model)
        rng = np.random.default_rng(1)
        mujoco.mj_integratePos(model, data.qpos, rng.normal(0, 0.1, model.nv), 1.0)
        data.qpos[1 if layout == "planar" else 2] += 0.0 if layout == "fixed" else 1.0
        data.qvel[:] = rng.normal(0, 1.0, model.nv)
        mujoco.mj_forward(model, data)
        passive.append(data.qfrc_passive.copy())
        top, jacobian = model.body("top").id, np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, data.xpos[top], top)
        velocity = jacobian @ data.qvel
        force = -0.3 * np.linalg.norm(velocity) * velocity
        force[0] += 0.05 - 2.0 * (data.xpos[top, 0] - rest)
        expected = jacobian.T @ force
    assert np.abs(expected[:-1]).min() > 1e-6
    assert passive[0] - passive[1] == pytest.approx(expected, abs=1e-12)


def test_a_cable_s_pull_is_a_pull_on_t(robot: Robot) -> None:
    tied = resting(with_effect(robot, "tether", pull=0.1))[1]
    assert tied.qpos == pytest.approx(resting(robot, 0.1)[1].qpos, abs=1e-9)


def test_a_cable_s_force_grows_with_the_way_from_the_place_at_rest(robot: Robot) -> None:
    rest = resting(robot)[1].body("top").xpos[0]
    tied = with_effect(robot, "tether", stiffness=3.0)
    assert resting(tied)[1].body("top").xpos[0] == pytest.approx(rest, abs=1e-12)
    for pull in (0.2, 0.4):
        held = resting(tied, pull)[1]
        left = pull - 3.0 * (held.body("top").xpos[0] - rest)
        assert 0.1 < left < 0.9 * pull
        assert held.qpos == pytest.approx(resting(robot, left)[1].qpos, abs=1e-9)


def test_robots_with_the_same_cable_are_equal(robot: Robot) -> None:
    """What is compiled for one then serves the other."""
    one, same, other = (applied(with_effect(robot, "tether", pull=p)) for p in (0.1, 0.1, 0.2))
    assert (one, hash(one)) == (same, hash(same))
    assert one != other


def test_a_cable_is_hung_where_the_real_robot_stands(robot: Robot) -> None:
    """Whatever the order of the effects, the sag by a mass does not strain it."""
    heavy = {"mass": 0.02}
    both = replace(robot, effects={"tether": {"stiffness": 3.0}, "top_mass": heavy})
    alone = replace(robot, effects={"top_mass": heavy})
    assert resting(both)[1].qpos == pytest.approx(resting(alone)[1].qpos, abs=1e-9)


def test_a_cable_stiffens_the_first_mode(robot: Robot) -> None:
    """By no more than it adds to T's static stiffness, most of which is the mode's."""
    stiffness, pull = 2.0, 1e-3
    moved = resting(robot, pull)[1].body("top").xpos - resting(robot)[1].body("top").xpos
    free, tied = (
        linear_modes(r, count=1)[0].hz
        for r in (robot, with_effect(robot, "tether", stiffness=stiffness))
    )
    added = stiffness * moved[0] / pull
    assert 0.8 * added < (tied / free) ** 2 - 1 < added
