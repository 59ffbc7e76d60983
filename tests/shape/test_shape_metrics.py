from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.schemas import load_shape
from workbench.shape import clearance, curve, metrics

LENGTH = 0.6


def arc(turn: float, joints: int = 600) -> np.ndarray:
    """A beam bent evenly by an angle in all [rad], its first increment along x."""
    return curve(np.array([0.0, *[turn / joints] * joints]), LENGTH)


def test_a_straight_beam_has_no_depth() -> None:
    found = metrics(curve(np.zeros(16), LENGTH))
    assert found.L0_m == pytest.approx(LENGTH)
    assert found.dh_m == pytest.approx(0, abs=1e-15)
    assert found.e == pytest.approx(0, abs=1e-15)


def test_a_half_circle_is_as_deep_as_its_radius() -> None:
    found = metrics(arc(np.pi))
    assert found.L0_m == pytest.approx(2 * LENGTH / np.pi, rel=3e-3)
    assert found.dh_m == pytest.approx(LENGTH / np.pi, rel=3e-3)
    assert found.e == pytest.approx(0.5, rel=3e-3)


def test_the_tip_of_the_thesis_first_shape() -> None:
    """Root to T as checked against the thesis' Appendix B (the root is at x = 0.0575 m)."""
    shape = load_shape("thesis-initial", Path()).content
    found = metrics(curve(shape.angles, shape.length))
    assert found.tip_x_m + 0.0575 == pytest.approx(0.0712, abs=1e-4)
    assert found.tip_z_m == pytest.approx(0.3265, abs=1e-4)
    assert found.L0_m == pytest.approx(np.hypot(found.tip_x_m, found.tip_z_m))


def test_turning_and_mirroring_change_neither_length_nor_depth() -> None:
    shape = load_shape("thesis-initial", Path()).content
    plain = metrics(curve(shape.angles, shape.length))
    for angles in ((1.0, *shape.angles[1:]), tuple(-a for a in shape.angles)):
        moved = metrics(curve(angles, shape.length))
        assert moved[:3] == pytest.approx(plain[:3])


def test_a_beam_that_ends_where_it_begins_has_an_endless_ratio() -> None:
    closed = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
    assert metrics(closed).e == np.inf
    assert metrics(closed).dh_m == pytest.approx(np.sqrt(2))


def test_a_loop_crosses_itself_and_an_arc_does_not() -> None:
    crossing = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 1.0], [0.5, -1.0]])
    assert clearance(crossing) == 0
    assert clearance(arc(1.5 * np.pi, 40)) > 0


def test_clearance_is_the_gap_between_parts_that_are_no_neighbours() -> None:
    hairpin = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.02], [0.0, 0.03]])
    assert clearance(hairpin) == pytest.approx(0.02, rel=1e-3)


def test_a_beam_that_touches_itself_end_on_has_no_clearance() -> None:
    touching = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 1.0], [0.5, 0.0]])
    assert clearance(touching) == 0
