from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.schemas import load_model, load_shape
from workbench.sim import (
    LIMITS,
    Condition,
    Drive,
    Robot,
    highest_mode,
    make_robot,
    require_stable,
    settle,
    simulate,
)
from workbench.sim.checks import require_valid


def changed(robot: Robot, **values: float) -> Robot:
    return replace(robot, values=dict(robot.values) | values)


@pytest.mark.parametrize(
    ("drive", "value", "words"),
    [
        ("speed", 61.0, r"speed 61 rad/s at sample 2 is outside -60 to 60 rad/s"),
        ("voltage", -6.5, r"voltage -6\.5 V at sample 2 is outside -6 to 6 V"),
        ("torque", 1.0, r"torque 1 N m at sample 2 is outside -0\.4\d+ to 0\.4\d+ N m"),
        ("speed", np.nan, r"speed is nan rad/s at sample 2; every sample must be a number"),
        ("voltage", np.inf, r"voltage is inf V at sample 2; every sample must be a number"),
        ("steam", 1.0, r"no drive 'steam'; drives that exist: speed, torque, voltage"),
    ],
)
def test_a_command_is_refused_with_value_unit_and_range(
    robot: Robot, drive: Drive, value: float, words: str
) -> None:
    command = np.array([0.0, 0.0, value, 0.0])
    with pytest.raises(InputError, match=words):
        simulate(robot, Condition("clamped", command, drive=drive))


@pytest.mark.parametrize("drive", LIMITS)
def test_the_limits_themselves_are_allowed(robot: Robot, drive: Drive) -> None:
    value = LIMITS[drive].value
    require_valid(robot, Condition("hop", np.array([-value, value]), drive=drive))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"hinge_damping": -0.001}, r"hinge_damping is -0\.001 N m s/rad; it must be at least 0"),
        ({"top_mass": np.nan}, r"parameter top_mass is nan kg; it must be above 0"),
        ({"beam_root": np.inf}, r"parameter beam_root is inf m; it must be a number"),
    ],
)
def test_an_impossible_parameter_is_named(
    robot: Robot, values: dict[str, float], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        simulate(changed(robot, **values), Condition("hop", np.zeros(2)))


def test_a_beam_may_start_behind_the_foot_s_centre(robot: Robot) -> None:
    require_valid(changed(robot, beam_root=-0.02), Condition("hop", np.zeros(1)))


def test_an_impossible_shape_is_named(robot: Robot) -> None:
    bent = replace(robot, angles=(robot.angles[0], np.nan, *robot.angles[2:]))
    with pytest.raises(InputError, match=r"angle alpha_1 is nan rad; it must be a number"):
        simulate(bent, Condition("hop", np.zeros(2)))
    with pytest.raises(InputError, match=r"the beam's length is 0 m; it must be above 0 m"):
        simulate(replace(robot, length=0.0), Condition("hop", np.zeros(2)))


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        (Condition("hop", np.zeros(2), start_angle=np.nan), "start angle is nan rad; it must be a"),
        (Condition("decay", np.zeros(2), pull=np.inf), "the pull on T is inf N; it must be a num"),
        (Condition("drop", np.zeros(2), height=np.nan), "height of the fall is nan m; it must be"),
        (
            Condition("hop", np.zeros(0)),
            r"command has shape \(0,\); it must be one row of at least",
        ),
        (Condition("hop", np.array(17.0)), r"command has shape \(\); it must be one row of"),
        (Condition("hop", np.zeros((2, 3))), r"command has shape \(2, 3\); it must be one row of"),
    ],
)
def test_an_impossible_condition_is_named(robot: Robot, condition: Condition, words: str) -> None:
    with pytest.raises(InputError, match=words):
        simulate(robot, condition)


def test_the_highest_mode_is_near_9000_rad_s(robot: Robot) -> None:
    mode = highest_mode(*settle(robot, "free", np.pi / 2))
    assert mode.omega == pytest.approx(9029, rel=0.01)
    assert mode.longest_step == pytest.approx(0.706e-3, rel=0.01)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"hinge_damping": 0.0, "root_damping": 0.0},
        {"hinge_stiffness": 38.0, "root_stiffness": 48.0},
    ],
)
@pytest.mark.parametrize(("share", "grows"), [(0.97, False), (1.03, True)])
def test_the_longest_step_is_where_it_blows_up(
    robot: Robot, values: dict[str, float], share: float, grows: bool
) -> None:
    model, data = settle(changed(robot, **values), "fixed", np.pi / 2)
    model.opt.timestep = share * highest_mode(model, data).longest_step
    data.qvel += 1e-3
    grew = False
    for _ in range(100):
        mujoco.mj_step(model, data, nstep=4)
        grew = grew or float(np.abs(data.qvel).max()) > 10
        if grew:
            break  # before the engine warns
    assert grew == grows


def test_a_step_that_cannot_be_stable_is_refused_with_what_to_change(robot: Robot) -> None:
    undamped = changed(robot, hinge_damping=0.0, root_damping=0.0)
    words = (
        r"steps of 0\.245 ms: its highest mode, 90\d\d rad/s with a damping ratio of 0, allows at "
        r"most 0\.210 ms; lower hinge_stiffness or root_stiffness, raise hinge_damping"
    )
    with pytest.raises(InputError, match=words):
        simulate(undamped, Condition("clamped", np.zeros(2)))


@pytest.mark.parametrize("increments", [4, 16, 64, 128])
def test_every_number_of_increments_is_stable(robot: Robot, increments: int) -> None:
    require_stable(*settle(replace(robot, increments=increments), "free", np.pi / 2))


def test_a_mode_that_is_none_is_refused() -> None:
    mode: Any = "clmped"
    with pytest.raises(InputError, match=r"'clmped' cannot be simulated.*'clamped'\?.*one of hop"):
        Condition(mode, np.full(10, 17.0))


def test_values_that_are_not_a_model_s_are_refused() -> None:
    values = load_model("thesis", Path()).content.values()
    shape = load_shape("thesis-initial", Path()).content
    with pytest.raises(
        InputError, match=r"'top_mas' is none of a model's; did you mean 'top_mass'"
    ):
        make_robot({**values, "top_mas": 1.0}, shape)
    del values["gravity"]
    with pytest.raises(InputError, match="values of a robot: gravity missing"):
        make_robot(values, shape)


def test_a_word_that_would_be_taken_for_another_is_refused(robot: Robot) -> None:
    wrong: Any = "fre"
    with pytest.raises(InputError, match=r"way to hold the foot named 'fre'; did you mean 'free'"):
        settle(robot, wrong, 0.0)
    with pytest.raises(InputError, match=r"no drive named 'sped'; did you mean 'speed'\?; there"):
        settle(robot, "free", 0.0, drive=cast(Drive, "sped"))
    with pytest.raises(InputError, match=r"state of a beam named 'loadd'; did you mean 'loaded'"):
        replace(robot, state=cast(Any, "loadd"))
