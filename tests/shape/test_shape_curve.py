from pathlib import Path

import mujoco
import numpy as np
import pytest

from workbench.schemas import load_model, load_shape
from workbench.shape import bend_radii, curve
from workbench.sim import compile_model, make_robot


def test_the_thesis_beam_reaches_back_and_ends_above_the_foot(tmp_path: Path) -> None:
    shape = load_shape("thesis-initial", tmp_path).content
    points = curve(shape.angles, shape.length) + np.array([0.0575, 0])
    assert points[-1] == pytest.approx([0.0712, 0.3265], abs=1e-4)
    assert points[:, 0].min() == pytest.approx(-0.138, abs=1e-3)
    assert points[:, 1].max() == pytest.approx(0.362, abs=1e-3)
    assert np.ptp(points, axis=0)[1] == pytest.approx(0.362, abs=1e-3)


def test_the_curve_is_where_the_simulation_has_the_beam(tmp_path: Path) -> None:
    shape = load_shape("thesis-initial", tmp_path).content
    robot = make_robot(load_model("thesis", tmp_path).content.values(), shape)
    model = compile_model(robot, "fixed")
    data = mujoco.MjData(model)
    data.qpos[:16] = shape.angles
    mujoco.mj_forward(model, data)
    bodies = [data.body(f"increment_{k}").xpos for k in range(16)] + [data.body("top").xpos]
    expected = curve(shape.angles, shape.length) + np.array([0.0575, 0])
    assert np.array(bodies)[:, [0, 2]] == pytest.approx(expected, abs=1e-12)


def test_many_shapes_at_once_give_the_same_as_one_by_one() -> None:
    angles = np.random.default_rng(1).normal(0, 0.3, (5, 3, 16))
    assert curve(angles, 0.6)[2, 1] == pytest.approx(curve(angles[2, 1], 0.6))


def test_radii_of_a_bend() -> None:
    radii = bend_radii([-2.5, 0.2, 0.0, -0.1], 0.4)
    assert radii == pytest.approx([0.5, np.inf, 1.0])
