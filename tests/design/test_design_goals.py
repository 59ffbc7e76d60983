from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from workbench.design import GOALS, PENALTY, Hop, Objective, Problem, goal_named, tipping_margin
from workbench.design.stability import centre_of_mass
from workbench.errors import InputError
from workbench.motion import summarize
from workbench.sim import Condition, Fanout, Robot, applied, gait, sample_times, settle, simulate


@pytest.fixture(scope="module")
def hop(robot: Robot) -> Hop:
    condition = Condition("hop", np.full(len(sample_times(2.0)), 19.0))
    return Hop(robot, simulate(robot, condition), 2.0)


def test_fitness_is_that_of_the_thesis() -> None:
    """Eq. 5.1 with a = 100, and a + 2 for what fails."""
    assert GOALS["distance"].fitness(1.25) == 100 - 1.25
    assert GOALS["distance"].value_of(98.75) == 1.25
    assert PENALTY == 102


def test_goals_are_what_simulate_tells(hop: Hop) -> None:
    told = summarize(hop.simulation.motion, hop.duration)
    cost = gait(hop.simulation, hop.duration).cost_of_transport
    assert GOALS["distance"].value(hop) == told.distance_m
    assert GOALS["height"].value(hop) == told.hop_height_m
    assert GOALS["cost"].value(hop) == pytest.approx(1 / cost)
    assert GOALS["stability"].value(hop) == tipping_margin(hop.robot, hop.simulation.motion)


def test_the_centre_of_mass_is_the_engine_s(robot: Robot) -> None:
    model, data = settle(robot, "free", 0.3)
    still = simulate(robot, Condition("hop", np.zeros(2), 0.3)).motion
    found = centre_of_mass(applied(robot), still)[0]
    own = data.subtree_com[1, [0, 2]] - data.body("foot").xpos[[0, 2]]
    assert found == pytest.approx(own, abs=1e-9)
    assert model.body(1).name == "foot"


def test_the_margin_at_rest_is_the_angle_to_the_front_edge(robot: Robot) -> None:
    """T stands 10 cm forward: the nearer edge is the front one."""
    still = simulate(robot, Condition("hop", np.zeros(12)))
    x, z = centre_of_mass(applied(robot), still.motion)[0]
    pitch = still.motion["foot_pitch_rad"][0]
    half = robot.values["foot_length"] / 2
    expected = math.atan2(half * math.cos(pitch) - x, z + half * math.sin(pitch))
    assert 0 < expected < math.pi / 2
    assert tipping_margin(robot, still.motion) == pytest.approx(expected, abs=1e-6)


def test_hopping_has_less_margin_than_standing(hop: Hop, robot: Robot) -> None:
    still = simulate(robot, Condition("hop", np.zeros(12)))
    assert tipping_margin(robot, hop.simulation.motion) < tipping_margin(robot, still.motion)


def test_a_robot_that_goes_nowhere_has_no_efficiency(robot: Robot) -> None:
    still = simulate(robot, Condition("hop", np.zeros(60)))
    assert GOALS["cost"].value(Hop(robot, still, 0.4)) == 0


def test_an_unknown_goal_is_refused_with_those_that_exist() -> None:
    with pytest.raises(InputError, match=r"'distanse'; did you mean 'distance'\?; there are"):
        goal_named("distanse")


def test_two_goals_are_two_numbers(changed: Callable[..., Problem]) -> None:
    two = changed(goals=(GOALS["distance"], GOALS["stability"]))
    (found,) = Objective(two, Fanout())(two.space.start[None])
    assert found.fitness == pytest.approx(
        (100 - found.numbers["distance_m"], 100 - found.numbers["tipping_margin_rad"] / 0.5)
    )
