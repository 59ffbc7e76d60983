from dataclasses import replace

import mujoco
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.sim import Robot, compile_model, hinge_name


def posed(robot: Robot, foot: str = "free") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The robot in the shape of its free strip, the rotor forward."""
    model = compile_model(robot, foot)  # pyright: ignore[reportArgumentType]
    data = mujoco.MjData(model)
    for k, angle in enumerate(robot.angles):
        data.joint(hinge_name(k)).qpos[:] = angle
    mujoco.mj_forward(model, data)
    return model, data


def test_the_masses_are_those_of_appendix_b(robot: Robot) -> None:
    model, _ = posed(robot)
    assert model.body_mass.sum() == pytest.approx(0.2574)
    assert model.body("foot").mass[0] == pytest.approx(0.073)
    assert model.body("top").mass[0] == pytest.approx(0.088)
    assert model.body("rotor").mass[0] == pytest.approx(0.0414)


def test_the_unloaded_beam_lies_where_the_angles_put_it(robot: Robot) -> None:
    _, data = posed(robot)
    assert data.body("top").xpos == pytest.approx([0.0712, 0, 0.3265], abs=1e-4)
    beam = np.array([data.body(f"increment_{k}").xpos for k in range(16)])
    assert beam[:, 0].min() == pytest.approx(-0.138, abs=1e-3)
    assert beam[:, 2].max() == pytest.approx(0.362, abs=1e-3)
    assert beam[0] == pytest.approx([0.0575, 0, 0])


def test_the_foot_s_inertia_follows_appendix_b(robot: Robot) -> None:
    model, _ = posed(robot)
    width, length = 0.248, 0.275
    assert model.body("foot").inertia == pytest.approx(
        0.073 / 12 * np.array([width**2, length**2, width**2 + length**2])
    )


def test_a_foot_of_any_mass_and_size_is_built(robot: Robot) -> None:
    rng = np.random.default_rng(0)
    for share in rng.uniform(0.7, 1.3, (40, 3)):
        names = ("foot_mass", "foot_length", "foot_width")
        changed = {n: robot.values[n] * s for n, s in zip(names, share, strict=True)}
        compile_model(replace(robot, values=dict(robot.values) | changed), "free")


def test_positive_rotor_speed_turns_from_forward_towards_down(robot: Robot) -> None:
    model, data = posed(robot)
    before = data.site("rotor").xpos.copy()
    data.joint("rotor").qpos[:] += 0.1
    mujoco.mj_forward(model, data)
    turned = data.site("rotor").xpos - data.body("top").xpos
    arm = before - data.body("top").xpos
    assert arm[2] * turned[0] - arm[0] * turned[2] > 0  # the y component of arm x turned
    assert np.linalg.norm(arm) == pytest.approx(0.035)


def test_the_rotor_is_a_point_on_a_slender_rod(robot: Robot) -> None:
    rotor = posed(robot)[0].body("rotor")
    centre = rotor.ipos[0]
    assert rotor.mass[0] * centre == pytest.approx(0.0334 * 0.035 + 0.008 * 0.0175)
    about_shaft = rotor.inertia[1] + rotor.mass[0] * centre**2
    assert about_shaft == pytest.approx(0.0334 * 0.035**2 + 0.008 * 0.035**2 / 3)


def test_a_clamped_robot_has_no_foot_joint_and_no_ground(robot: Robot) -> None:
    model, _ = posed(robot, "fixed")
    assert model.nv == 17
    assert model.nuserdata == 0


def test_what_the_engine_refuses_is_an_input_error(robot: Robot) -> None:
    bad = replace(robot, values=dict(robot.values) | {"beam_mass": 0.0})
    with pytest.raises(InputError, match=r"this robot cannot be simulated: .*mass"):
        compile_model(bad, "free")
