"""How far a robot may hop within its tolerances."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.design import DistanceDraws, draw_distances
from workbench.schemas import load_model, load_shape
from workbench.sim import Condition, Robot, make_robot, simulate

HOP = Condition("hop", np.full(241, 17.0))


@pytest.fixture(scope="module")
def robot() -> Robot:
    values = load_model("thesis", Path()).content.values()
    return make_robot(values, load_shape("thesis-initial", Path()).content)


def test_without_tolerances_only_start_angle_and_speed_vary(robot: Robot) -> None:
    backward = replace(HOP, command=-HOP.command)
    forward, back = draw_distances([(robot, HOP), (robot, backward)], {}, draws=6)
    again, _ = draw_distances([(robot, HOP), (robot, HOP)], {}, draws=6)
    assert forward == again
    assert forward != back
    assert forward.failed == 0
    assert forward.share(0.05) < forward.share(0.5) < forward.share(0.95)
    motion = simulate(robot, HOP).motion["foot_x_m"]
    assert float(motion[-1]) not in forward.distances


def test_a_wider_tolerance_spreads_the_distance(robot: Robot) -> None:
    ((narrow,), (wide,)) = (
        draw_distances([(robot, HOP)], {"friction_slide": tolerance}, draws=8)
        for tolerance in (1e-6, 0.3)
    )
    assert np.std(wide.distances) > np.std(narrow.distances)


def test_robots_that_fall_are_counted_and_said(robot: Robot) -> None:
    heavy = replace(robot, values={**robot.values, "top_mass": 0.3})
    (found,) = draw_distances([(heavy, HOP)], {}, draws=3)
    assert found == DistanceDraws((), 3)
    assert found.text() == "none of 3 draws hopped to the end"
    assert found.as_json()["failed"] == 3


def test_its_words_and_numbers_agree() -> None:
    spread = DistanceDraws(tuple(np.linspace(0.0, 0.2, 21).tolist()), 1)
    assert spread.text() == "10 to 190 mm, median 100 mm (22 draws, 1 failed)"
    assert spread.as_json() == {
        "low_m": pytest.approx(0.01), "median_m": pytest.approx(0.1), "high_m": pytest.approx(0.19),
        "draws": 22, "failed": 1,
    }  # fmt: skip
