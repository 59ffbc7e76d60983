"""What a beam does in small motions: against the engine, one shape at a time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.design import Objective, Problem, parse_varied
from workbench.design.bendable import beam_points
from workbench.design.description import Description
from workbench.design.small_motions import DESCRIPTORS, descriptors, small_motions, stand
from workbench.schemas import load_model, load_shape
from workbench.sim import Fanout, applied, linear_modes, settle, unloaded

MODEL = load_model("thesis", Path()).content
SHAPES = [
    load_shape(name, Path()).content
    for name in ("thesis-initial", "thesis-ga-start", "optimised-17", "optimised-19")
]
LENGTH = SHAPES[0].length
ANGLES = np.array([shape.angles for shape in SHAPES])


def test_modes_are_those_of_the_engine() -> None:
    """The rotor as a point at T: frequency, damping left out, and where T swings."""
    motions = small_motions(MODEL.values(), ANGLES, LENGTH)
    problem = Problem(MODEL, SHAPES[0])
    for k, angles in enumerate(ANGLES):
        modes = linear_modes(problem.robot(angles))
        hz = [mode.hz for mode in modes]
        np.testing.assert_allclose(motions.omega[k] / (2 * np.pi), hz, rtol=1e-4)
        swing = motions.swing[k, :, :2] / np.linalg.norm(motions.swing[k, :, :2], axis=0)
        engine = np.array([mode.top_direction for mode in modes[:2]]).T
        np.testing.assert_allclose(np.abs(np.sum(swing * engine, axis=0)), 1.0, atol=1e-5)


@pytest.mark.parametrize("state", ["unloaded", "loaded"])
def test_where_t_stands_is_where_the_engine_has_it(state: str) -> None:
    problem = Problem(MODEL, SHAPES[0].model_copy(update={"state": state}))
    standing = state == "loaded"
    motions = small_motions(MODEL.values(), ANGLES, LENGTH, standing=standing)
    for k, angles in enumerate(ANGLES):
        _, data = settle(unloaded(applied(problem.robot(angles))), "fixed", np.pi / 2)
        top = data.body("top").xpos[[0, 2]] - data.body("foot").xpos[[0, 2]]
        # the engine takes standing angles with the foot tipped by the load, the chain without
        np.testing.assert_allclose(motions.tip[k], top, atol=5e-3 if standing else 1e-4)


@pytest.mark.parametrize("state", ["unloaded", "loaded"])
def test_a_robot_stands_where_the_engine_has_it(state: str) -> None:
    """The foot pitches under the load, T moves by centimetres with it."""
    problem = Problem(MODEL, SHAPES[0].model_copy(update={"state": state}))
    rest = stand(MODEL.values(), ANGLES, LENGTH, standing=state == "loaded")
    for k, angles in enumerate(ANGLES):
        model, data = settle(unloaded(applied(problem.robot(angles))), "free", np.pi / 2)
        points, foot = beam_points(model, data), data.body("foot").xpos
        found = [rest.tip_x[k], rest.tip_z[k], rest.lowest[k]]
        engine = [points[-1, 0] - foot[0], points[-1, 1], points[1:, 1].min() - foot[2]]
        np.testing.assert_allclose(found, engine, atol=1e-4)


def test_a_strip_that_buckles_does_not_stand() -> None:
    heavy = MODEL.values() | {"top_mass": 3.0}
    upright = np.array([[-np.pi / 2, *15 * [0.0]]])
    assert np.isnan(stand(heavy, upright, LENGTH).tip_x).all()


def test_shapes_of_different_masses_are_told_apart() -> None:
    masses = np.linspace(0.05, 0.15, 4)
    values = MODEL.values() | {"top_mass": masses}
    together = small_motions(values, np.tile(ANGLES[0], (4, 1)), LENGTH)
    for k, mass in enumerate(masses):
        alone = small_motions(MODEL.values() | {"top_mass": mass}, ANGLES[:1], LENGTH)
        np.testing.assert_allclose(together.omega[k], alone.omega[0], rtol=1e-9)
    assert np.all(np.diff(together.omega[:, 0]) < 0)


def test_modes_are_named_by_where_they_swing_not_by_which_is_slower() -> None:
    motions = small_motions(MODEL.values(), ANGLES, LENGTH)
    order = [1, 0, 2]
    swapped = motions._replace(omega=motions.omega[:, order], swing=motions.swing[:, :, order])
    named = descriptors(motions)
    kept = [k for k, name in enumerate(DESCRIPTORS) if name != "third"]
    np.testing.assert_array_equal(descriptors(swapped)[:, kept], named[:, kept])
    rising, falling = (DESCRIPTORS.index(f"{name}_sin") for name in ("rising", "falling"))
    assert np.all(named[:, rising] > named[:, falling])


def test_a_description_tells_shape_and_what_is_varied_beside() -> None:
    varied = (parse_varied("top_mass=0.05:0.15"), parse_varied("omega=15:21"))
    problem = Problem(MODEL, SHAPES[0], varied=varied)
    candidates = problem.space.sample(np.random.default_rng(0), 20)
    candidates[0] = problem.space.start
    described = Description(problem)(candidates)
    assert described.shape == (20, len(DESCRIPTORS) + 2)
    plain = Description(replace(problem, varied=()))(candidates[:1, :16])
    np.testing.assert_allclose(described[0, : len(DESCRIPTORS)], plain[0])
    assert described[0, -1] == 17.0


def test_what_is_described_and_bendable_is_what_the_objective_does_not_refuse() -> None:
    """Where shapes overhang, lie low or cross themselves, and where none of them is asked for."""
    problem = Problem(MODEL, SHAPES[0], duration=0.1)
    describe, drawn = Description(problem), np.random.default_rng(2)
    candidates = np.vstack([problem.space.sample(drawn, 30), near(problem, SHAPES[2].angles, 70)])
    with Fanout() as fanout:
        objective = Objective(problem, fanout)
        found = objective(candidates)
    stands = [
        one.failure is None or "fell" in one.failure or "blew" in one.failure for one in found
    ]
    described = np.isfinite(describe(candidates)).all(axis=1)
    bendable = np.array([objective.bendable(candidate) for candidate in candidates])
    assert (described & bendable).tolist() == stands
    assert 0.2 < np.mean(stands) < 0.8
    assert describe(candidates[~described]).shape == (np.sum(~described), len(DESCRIPTORS))


def near(problem: Problem, angles: tuple[float, ...], count: int) -> np.ndarray:
    """Return shapes that differ from one by up to a twentieth of the bounds."""
    off = np.random.default_rng(3).uniform(-0.05, 0.05, (count, len(angles)))
    return problem.space.project(np.array(angles) + off * problem.space.widths)


def test_what_rings_near_the_drive() -> None:
    """A shape found for 17 rad/s does at that speed and not at 30; a varied speed is its own."""
    problem = Problem(MODEL, SHAPES[2], omega=17.0)
    for omega, near in ((17.0, True), (-17.0, True), (30.0, False)):
        describe = Description(replace(problem, omega=omega))
        assert describe.rings_near_drive(describe(ANGLES[2:3])).tolist() == [near]
    describe = Description(replace(problem, varied=(parse_varied("omega=10:40"),)))
    described = describe(np.column_stack([ANGLES[[2, 2]], [17.0, 30.0]]))
    assert describe.rings_near_drive(described).tolist() == [True, False]
