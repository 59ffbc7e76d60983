"""A hop goes on from a stance as it went on in the simulation that the stance was taken from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.motion import ROTOR_ANGLE
from workbench.protocol import load_model, load_shape
from workbench.sim import STANCE, Condition, Robot, Standing, make_robot, spread

PLACES = ("foot_x_m", "foot_z_m", "top_x_m", "top_z_m")
STILL = np.zeros(len(STANCE))
STILL[-1] = np.pi / 2


@pytest.fixture(scope="module")
def robot() -> Robot:
    model, shape = load_model("thesis", Path()).content, load_shape("thesis-initial", Path())
    return replace(make_robot(model.values(), shape.content), planar=True)


@pytest.fixture(scope="module")
def still(robot: Robot) -> Standing:
    return Standing.of(robot, Condition("hop", np.zeros(240)))


def changed(**by: float) -> np.ndarray:
    stance = STILL.copy()
    for name, value in by.items():
        stance[STANCE.index(name.replace("_", " "))] += value
    return stance


def test_a_robot_at_rest_stays_there(still: Standing) -> None:
    motion = still.go_on([30], STILL[None], 60)[0].select((*PLACES, ROTOR_ANGLE))
    assert motion.times[0] == pytest.approx(30 / 120)
    assert np.ptp(motion.values, axis=0).max() < 1e-6
    assert np.abs(motion.values[0, :2]).max() < 1e-9


def test_what_a_stance_says_is_what_it_begins_with(still: Standing) -> None:
    stance = changed(foot_x=0.25, bend_0=0.02, rotor=40 * np.pi)
    rest, moved = (one.select((*PLACES, ROTOR_ANGLE)).values[0] for one in
                   still.go_on([0, 0], np.array([STILL, stance]), 3))  # fmt: skip
    assert moved[0] - rest[0] == pytest.approx(0.25)
    assert moved[1] == pytest.approx(rest[1], abs=1e-9)
    assert moved[-1] == pytest.approx(stance[-1])
    assert np.hypot(*(moved[2:4] - rest[2:4] - [0.25, 0])) > 1e-3


def test_a_mode_rings_at_its_rate(still: Standing) -> None:
    """What begins with a bend of the lowest mode swings back in half a period and not before."""
    bent, struck = still.go_on([0, 0], np.array([changed(bend_0=0.01), changed(rate_0=0.2)]), 120)
    away = bent.select(("top_x_m",)).values[:, 0]
    rate = np.gradient(struck.select(("top_x_m",)).values[:, 0])
    assert np.sign(away[0]) == np.sign(rate[1])  # a bend and its rate go the same way
    assert away.min() < 0 < away.max() or np.abs(away[-1]) < np.abs(away[0])


def test_windows_of_one_robot_do_not_depend_on_each_other(still: Standing) -> None:
    stances = np.array([changed(bend_0=0.02), changed(foot_pitch=0.01), changed(rate_1=0.5)])
    together = still.go_on([0, 10, 20], stances, 30)
    for begin, stance, one in zip((0, 10, 20), stances, together, strict=True):
        alone = still.go_on([begin], stance[None], 30)[0]
        np.testing.assert_array_equal(alone.values, one.values)
        np.testing.assert_array_equal(alone.times, one.times)


def test_the_command_is_that_of_the_moment(robot: Robot) -> None:
    command = np.repeat([5.0, 15.0], 60)
    standing = Standing.of(robot, Condition("hop", command))
    slow, fast = (
        np.ptp(one.select((ROTOR_ANGLE,)).values) for one in
        standing.go_on([10, 70], np.array([STILL, STILL]), 13)
    )  # fmt: skip
    assert fast == pytest.approx(3 * slow, rel=0.05)


def test_work_is_spread_in_order() -> None:
    assert spread(lambda one: one**2, range(7), threads=3) == [one**2 for one in range(7)]
    assert spread(lambda one: one + 1, [1], threads=0) == [2]
