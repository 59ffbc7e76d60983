from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from workbench.design import Objective, Problem, Uncertainty, Varied, altered
from workbench.errors import InputError
from workbench.motion import summarize
from workbench.sim import Condition, Fanout, Robot, sample_times, simulate

TOLERANCES = {"friction_slide": 0.2, "friction_stick": 0.1, "top_mass": 0.002}


def other(problem: Problem, **angles: float) -> np.ndarray:
    """The first shape with some angles changed."""
    found = problem.space.start.copy()
    for name, value in angles.items():
        found[problem.space.names.index(name)] = value
    return found


def test_a_candidate_is_worth_what_it_hops(problem: Problem, robot: Robot) -> None:
    (found,) = Objective(problem, Fanout())(problem.space.start[None])
    hop = simulate(robot, Condition("hop", np.full(len(sample_times(1.0)), 17.0)))
    distance = summarize(hop.motion, 1.0).distance_m
    assert found.fitness == (100 - distance,)
    assert found.numbers["distance_m"] == distance
    assert found.failure is None


def test_the_plane_is_enough(problem: Problem) -> None:
    """Candidates move in the hopping plane; the whole robot goes as far."""
    robot = problem.robot(problem.space.start)
    condition = problem.condition(problem.space.start)
    flat, free = (simulate(replace(robot, planar=p), condition).motion for p in (True, False))
    assert flat["foot_x_m"] == pytest.approx(free["foot_x_m"], abs=1e-9)


def test_failures_cost_their_own_place_only(problem: Problem) -> None:
    start = problem.space.start
    wound = other(problem, **{f"alpha_{k}": 0.6 for k in range(1, 16)})
    dipping = other(
        problem, alpha_0=-3.0, alpha_1=-0.1, alpha_2=-0.1, **{f"alpha_{k}": 0.1 for k in (8, 9)}
    )
    loose = other(problem, alpha_0=-1.0)
    found = Objective(problem, Fanout())(np.array([wound, start, dipping, loose, start]))
    good, again = found[1], found[4]
    assert good.failure is None
    assert good == again
    assert [one.fitness for one in (found[0], found[2], found[3])] == [(102.0,)] * 3
    assert found[0].failure is not None
    assert "outside the bounds of the angles or of their sum" in found[0].failure
    for one in (found[2], found[3]):
        assert one.failure is not None
        assert one.failure.startswith("this ")


def test_a_fall_is_a_penalty_that_says_when(changed: Callable[..., Problem]) -> None:
    heavy = changed(duration=2.0, varied=(Varied("rotor_mass", 0.03, 0.2),))
    (found,) = Objective(heavy, Fanout())(other(heavy, rotor_mass=0.1)[None])
    assert found.fitness == (102.0,)
    assert found.failure is not None
    assert re.fullmatch(r"the robot fell: T came below 0.05 m after 1.\d+ s", found.failure)


def test_a_varied_number_changes_the_robot_and_the_speed(changed: Callable[..., Problem]) -> None:
    varied = (Varied("omega", 15.0, 21.0), Varied("rotor_mass", 0.02, 0.05))
    wider = changed(varied=varied)
    candidate = other(wider, omega=19.0, rotor_mass=0.04)
    assert wider.robot(candidate).values["rotor_mass"] == 0.04
    assert set(wider.condition(candidate).command) == {19.0}
    assert wider.robot(candidate).angles == wider.shape.angles


def test_every_candidate_meets_the_same_departures() -> None:
    first, same = (Uncertainty(TOLERANCES, 4, seed).departures for seed in (1, 1))
    (different, *_) = Uncertainty(TOLERANCES, 4, 2).departures
    for one, other_one in zip(first, same, strict=True):
        assert one.values == other_one.values
        assert one.omega == other_one.omega
        assert one.angles.tobytes() == other_one.angles.tobytes()
    assert different.omega != first[0].omega


def test_departures_have_the_stated_size() -> None:
    """Even within the tolerance, its standard deviation that over sqrt 3; the others normal."""
    drawn = Uncertainty(TOLERANCES, 400, 3, speed_error=0.5, bend_error=0.02).departures
    slides = np.array([one.values["friction_slide"] for one in drawn])
    assert np.abs(slides).max() <= 0.2
    assert slides.std() == pytest.approx(0.2 / np.sqrt(3), rel=0.02)
    assert np.std([one.omega for one in drawn]) == pytest.approx(0.5, rel=0.02)
    assert np.std([one.angles for one in drawn]) == pytest.approx(0.02, rel=0.02)
    turned = np.array([one.turned for one in drawn])
    assert (np.histogram(turned, 4, (-np.pi, np.pi))[0] == 100).all()


def test_a_robot_sticks_at_least_as_well_as_it_slides(robot: Robot) -> None:
    for departure in Uncertainty(TOLERANCES, 50).departures:
        values = altered(robot, departure).values
        assert values["friction_stick"] >= values["friction_slide"] > 0


def test_robust_fitness_is_mean_plus_spread_of_the_draws(
    problem: Problem, changed: Callable[..., Problem]
) -> None:
    uncertainty = Uncertainty(TOLERANCES, draws=3, seed=5, weight=2.0)
    robust = changed(uncertainty=uncertainty)
    start = problem.space.start
    (found,) = Objective(robust, Fanout())(start[None])
    each = []
    for departure in uncertainty.departures:
        robot = altered(robust.robot(start), departure)
        hop = simulate(robot, robust.condition(start, departure))
        each.append(100 - summarize(hop.motion, 1.0).distance_m)
    assert found.fitness == pytest.approx((np.mean(each) + 2.0 * np.std(each, ddof=1),))
    assert found.numbers["failed_draws"] == 0
    assert found.numbers["distance_m"] == pytest.approx(100 - np.mean(each))
    assert found.numbers["spread_distance_m"] == pytest.approx(np.std(each, ddof=1))


def test_one_draw_has_no_spread() -> None:
    with pytest.raises(InputError, match="1 draws have no spread; take at least 2"):
        Uncertainty(TOLERANCES, draws=1)


def test_problems_differ_in_their_identity(problem: Problem) -> None:
    others = [
        replace(problem, omega=18.0),
        replace(problem, duration=2.0),
        replace(problem, uncertainty=Uncertainty(TOLERANCES)),
        replace(problem, least_radius=0.05),
        replace(problem, shape=problem.shape.model_copy(update={"state": "loaded"})),
    ]
    assert len({one.identity for one in (problem, *others)}) == 6
    renamed = problem.shape.model_copy(update={"name": "x", "source": "elsewhere"})
    assert replace(problem, shape=renamed).identity == problem.identity


def test_a_speed_that_cannot_be_simulated_is_refused(problem: Problem) -> None:
    with pytest.raises(InputError, match=r"omega 1e\+06 rad/s is outside"):
        replace(problem, omega=1e6)


def test_a_draw_that_falls_counts_as_the_penalty(changed: Callable[..., Problem]) -> None:
    uncertainty = Uncertainty({"rotor_mass": 0.06}, 4, speed_error=0.0, bend_error=0.0)
    heavy = changed(
        duration=2.0, varied=(Varied("rotor_mass", 0.03, 0.2),), uncertainty=uncertainty
    )
    (found,) = Objective(heavy, Fanout())(other(heavy, rotor_mass=0.095)[None])
    failed = int(found.numbers["failed_draws"])
    assert 0 < failed < 4
    assert found.failure is None
    mean = ((4 - failed) * (100 - found.numbers["distance_m"]) + failed * 102) / 4
    assert found.fitness[0] > mean + 0.5  # less the spread, of which there is much
    assert found.fitness[0] < 104
