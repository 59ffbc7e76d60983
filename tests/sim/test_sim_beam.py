from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from workbench.shape import curve
from workbench.sim import Robot, linear_modes, settle
from workbench.sim.beam import hinges


def smooth_turn(robot: Robot, along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the turn of the smooth strip from its root at places in listed increments [rad]."""
    ends = np.arange(16) + 0.5
    turned = np.concatenate([[0.0], np.cumsum(robot.angles[1:])])
    return CubicSpline(ends, turned, bc_type="natural")(np.clip(along, 0.5, 15.5))


@pytest.mark.parametrize("increments", [4, 8, 16, 24, 32, 64])
def test_every_chain_bends_and_yields_as_the_listed_one(robot: Robot, increments: int) -> None:
    chain = hinges(robot.angles, robot.values, increments)
    assert len(chain) == increments
    # what a coarse chain cannot place, the last half increment, does not move T
    tail = 16 / increments / 2 - 0.5
    lost = max(0.0, tail) * robot.angles[-1]
    assert sum(h.angle for h in chain) == pytest.approx(sum(robot.angles) - lost, abs=0.35)
    yielding = sum(1 / h.stiffness for h in chain if h.stiffness is not None)
    if increments >= 16:
        assert sum(h.angle for h in chain) == pytest.approx(sum(robot.angles))
        assert yielding == pytest.approx(1 / 12 + 15 / 9.5)


def test_the_listed_chain_is_left_as_it_is(robot: Robot) -> None:
    chain = hinges(robot.angles, robot.values, 16)
    assert [h.angle for h in chain] == list(robot.angles)
    assert [h.stiffness for h in chain] == [12.0] + [9.5] * 15
    assert [h.damping for h in chain] == [0.03] + [0.003] * 15


def test_damping_stays_in_proportion_to_stiffness(robot: Robot) -> None:
    for hinge in hinges(robot.angles, robot.values, 48)[1:]:
        if hinge.stiffness is not None:
            assert hinge.damping / hinge.stiffness == pytest.approx(0.003 / 9.5)


def test_a_finer_curve_comes_to_the_smooth_strip_with_the_square_of_its_increments(
    robot: Robot,
) -> None:
    """A strip that bends evenly within each part would end 2.0 mm from the listed chain."""
    along = np.linspace(0.0, 16.0, 100_001)
    direction = robot.angles[0] + smooth_turn(robot, along)
    step = robot.length / 16
    x, z = (np.trapezoid(one(direction), along) * step for one in (np.cos, np.sin))
    ends = {
        n: curve([h.angle for h in hinges(robot.angles, robot.values, n)], robot.length)[-1]
        for n in (16, 32, 64, 128)
    }
    off = {n: float(np.linalg.norm(end - [x, -z])) for n, end in ends.items()}
    assert off[16] < 0.0005
    assert off[64] < 1e-4
    assert off[32] / off[64] == pytest.approx(4.0, rel=0.1)
    assert off[64] / off[128] == pytest.approx(4.0, rel=0.1)


def test_the_standing_height_converges(robot: Robot) -> None:
    height = {
        n: settle(replace(robot, increments=n), "fixed", np.pi / 2)[1].body("top").xpos[2]
        for n in (8, 16, 32, 64)
    }
    assert abs(height[64] - height[32]) < 0.0002
    assert abs(height[64] - height[16]) < 0.0015


@pytest.mark.parametrize("increments", [17, 20, 25, 33, 40])
def test_every_chain_bends_and_yields_about_the_same_place(robot: Robot, increments: int) -> None:
    """Places along the strip in listed increments; the listed hinges 1 to 15 yield about 8."""
    chain = hinges(robot.angles, robot.values, increments)[1:]
    places = (np.arange(len(chain)) + 1) * 16 / increments
    bends = [hinge.angle for hinge in chain]
    along = np.linspace(0.0, 16.0, 100_001)
    turned = smooth_turn(robot, along)
    assert places @ bends == pytest.approx(16 * turned[-1] - np.trapezoid(turned, along), rel=1e-6)
    yielding = np.array([1 / hinge.stiffness for hinge in chain if hinge.stiffness])
    assert places[: len(yielding)] @ yielding == pytest.approx(8 * 15 / 9.5)


def test_what_a_chain_gets_wrong_falls_smoothly_with_the_square_of_its_increments(
    robot: Robot,
) -> None:
    """Within 1 % of that law; one that gathers what lies around a hinge is off by 20 to 230 %."""
    hz = {n: linear_modes(replace(robot, increments=n))[0].hz for n in (24, 29, 33, 36, 41, 48)}
    counts = np.array(list(hz)) ** -2.0
    slope, limit = np.polyfit(counts, list(hz.values()), 1)
    off = np.array(list(hz.values())) - limit
    assert slope < 0
    assert off == pytest.approx(slope * counts, rel=0.05)


def test_t_is_the_same_body_at_the_end_of_any_chain(robot: Robot) -> None:
    inertias = [
        settle(replace(robot, increments=n), "fixed", np.pi / 2)[0].body("top").inertia
        for n in (16, 32)
    ]
    assert inertias[0] == pytest.approx(inertias[1])
    assert inertias[0][1] == pytest.approx(0.088 / 12 * (robot.length / 16) ** 2)
