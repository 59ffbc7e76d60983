from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from workbench.design import BendableStrip, Problem
from workbench.errors import InputError
from workbench.sim import Robot, compile_model, settle

LENGTH = 0.615


def stand(robot: Robot, angles: tuple[float, ...], strip: BendableStrip) -> None:
    strip.require_upright(*settle(replace(robot, angles=angles), "free", math.pi / 2))


def test_the_first_shape_can_be_bent_and_stands(robot: Robot, problem: Problem) -> None:
    problem.strip.require_bendable(robot.angles)
    stand(robot, robot.angles, problem.strip)


def test_too_tight_a_bend_is_named_with_its_joint() -> None:
    angles = [-2.5, *[0.2] * 15]
    angles[4] = 2.0  # 615 mm / 16 / 2 rad
    with pytest.raises(InputError, match=r"radius at joint 4 is 19.2 mm, at least 30 mm"):
        BendableStrip(LENGTH).require_bendable(angles)
    BendableStrip(LENGTH, least_radius=0.019).require_bendable(angles)


def test_a_strip_wound_up_crosses_itself() -> None:
    """Figure 5.2: a sum below 1.2 pi alone does not keep a loop out, nor do the bounds."""
    wound = [-2.0, *[0.0] * 3, *[0.55] * 12]
    with pytest.raises(InputError, match="cannot be bent: bent, its strip crosses itself"):
        BendableStrip(LENGTH).require_bendable(wound)


def test_a_thick_strip_needs_room_between_its_parts() -> None:
    straight, turn = [0.0] * 5, [math.pi / 4] * 4
    hairpin = np.array([-2.0, *straight, *turn, *straight, 0.0])
    BendableStrip(LENGTH, thickness=0.002).require_bendable(hairpin)
    with pytest.raises(InputError, match=r"come within \d+\.\d mm and the strip is 100 mm thick"):
        BendableStrip(LENGTH, thickness=0.1).require_bendable(hairpin)


def test_a_top_that_overhangs_the_foot_is_refused(robot: Robot, problem: Problem) -> None:
    leaning = (
        *(-2.36, -0.04, 0.09, 0.08, 0.14, 0.17, 0.18, 0.15),
        *(0.1, 0.22, 0.52, 0.45, 0.35, 0.27, 0.4, 0.07),
    )
    with pytest.raises(InputError, match=r"at rest T is 12 mm off the foot's edge.*137.5 mm of"):
        stand(robot, leaning, problem.strip)


def test_a_beam_that_dips_below_the_foot_is_refused(robot: Robot, problem: Problem) -> None:
    low = (-3.0, -0.1, -0.1, -0.1, *[0.2] * 12)
    model = compile_model(robot, "free")
    data = mujoco.MjData(model)
    data.qpos[-17:-1] = low  # as if nothing bent it
    mujoco.mj_forward(model, data)
    with pytest.raises(InputError, match=r"at rest its strip reaches -?\d+ mm from the foot"):
        problem.strip.require_upright(model, data)
