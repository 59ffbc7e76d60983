from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.schemas import load_shape
from workbench.shape import Arcs, crossing, curve, equal_length_arcs

THICKNESS = 0.002


@pytest.fixture(scope="module")
def thesis() -> tuple[NDArray[np.float64], float]:
    shape = load_shape("thesis-initial", Path()).content
    return np.array(shape.angles), shape.length


def walked(angles: NDArray[np.float64], length: float, steps: int) -> NDArray[np.float64]:
    """The line by summing tiny straight steps, each turned by its share of the bend."""
    increment = length / len(angles)
    middle = (np.arange(steps) + 0.5) * length / steps
    share = np.clip(middle[:, None] / increment - np.arange(1, len(angles)) + 0.5, 0, 1)
    heading = angles[0] + share @ angles[1:]
    steps_xz = length / steps * np.stack([np.cos(heading), -np.sin(heading)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps_xz, axis=0)])


def test_the_line_is_that_of_many_tiny_steps(thesis: tuple[NDArray[np.float64], float]) -> None:
    angles, length = thesis
    steps = 64000
    truth = walked(angles, length, steps)
    found = equal_length_arcs(angles, length).points_at(np.linspace(0, length, steps + 1))
    print(f"worst distance to the summed line {1e6 * np.abs(found - truth).max():.4f} um")
    assert found == pytest.approx(truth, abs=1e-8)


def test_length_and_headings_are_the_polyline_s(thesis: tuple[NDArray[np.float64], float]) -> None:
    angles, length = thesis
    line = equal_length_arcs(angles, length)
    middles = (np.arange(16) + 0.5) * length / 16
    assert line.length == pytest.approx(0.615008, abs=1e-12)
    assert line.headings_at(middles) == pytest.approx(np.cumsum(angles), abs=1e-12)
    chords = np.linalg.norm(np.diff(line.points_at(np.linspace(0, length, 4001)), axis=0), axis=1)
    assert chords.sum() == pytest.approx(0.615008, abs=1e-7)
    away = 1000 * np.linalg.norm(line.knot_points[-1] - curve(angles, length)[-1])
    assert away == pytest.approx(2.0, abs=0.1)  # reference: the tip moves by 2.0 mm


def test_tangents_and_normals_are_unit_vectors_at_right_angles(
    thesis: tuple[NDArray[np.float64], float],
) -> None:
    line = equal_length_arcs(*thesis)
    at = np.linspace(0, line.length, 50)
    tangent, normal = line.tangents_at(at), line.normals_at(at)
    step = 1e-7
    moved = (line.points_at(at + step) - line.points_at(at - step)) / (2 * step)
    assert tangent == pytest.approx(moved, abs=1e-6)
    across = tangent[:, 0] * normal[:, 1] - tangent[:, 1] * normal[:, 0]
    assert across == pytest.approx(np.ones(50))


def test_contours_lie_half_a_thickness_off_and_differ_by_thickness_times_bend(
    thesis: tuple[NDArray[np.float64], float],
) -> None:
    angles, length = thesis
    line = equal_length_arcs(angles, length)
    outer, inner = line.offset(THICKNESS / 2), line.offset(-THICKNESS / 2)
    assert outer.length - inner.length == pytest.approx(THICKNESS * angles[1:].sum(), abs=1e-12)
    centre = line.points_at(np.linspace(0, length, 20001))
    for contour in (outer, inner):
        on = contour.points_at(np.linspace(0, contour.length, 37))
        nearest = np.linalg.norm(on[:, None] - centre[None], axis=2).min(axis=1)
        assert nearest == pytest.approx(np.full(37, THICKNESS / 2), abs=1e-6)


def test_the_box_holds_the_line_and_touches_it(thesis: tuple[NDArray[np.float64], float]) -> None:
    angles, length = thesis
    for turn in np.linspace(0, 6, 13):
        line = equal_length_arcs(angles, length).moved(turn, (0.1, -0.2))
        dense = line.points_at(np.linspace(0, length, 20001))
        box = line.box()
        assert box.low == pytest.approx(dense.min(axis=0), abs=1e-7)
        assert box.high == pytest.approx(dense.max(axis=0), abs=1e-7)
    size = 1000 * equal_length_arcs(angles, length).box().size
    assert size == pytest.approx([210, 362], abs=1.5)


def test_a_circle_is_one(thesis: tuple[NDArray[np.float64], float]) -> None:
    radius = 0.3
    line = Arcs(np.zeros(2), 0.0, np.array([2 * np.pi * radius]), np.array([2 * np.pi]))
    assert line.knot_points[-1] == pytest.approx([0, 0], abs=1e-12)
    assert line.box().low == pytest.approx([-radius, -2 * radius])
    assert line.box().high == pytest.approx([radius, 0])


def test_mirrored_turned_and_shifted_is_what_moving_its_points_gives(
    thesis: tuple[NDArray[np.float64], float],
) -> None:
    line = equal_length_arcs(*thesis)
    at = np.linspace(0, line.length, 50)
    turn, shift = 0.7, np.array([0.3, -0.1])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    expected = (line.points_at(at) * [-1, 1]) @ rotation.T + shift
    assert line.moved(turn, shift, mirror=True).points_at(at) == pytest.approx(expected, abs=1e-12)


def test_a_contour_beyond_the_centre_of_an_arc_is_refused() -> None:
    line = equal_length_arcs([0.0, 2.0], 0.02)  # a radius of 5 mm
    with pytest.raises(InputError, match=r"6 mm from the centreline .* radius there is 5\.0 mm"):
        line.offset(-0.006)


def test_crossing_tells_a_bow_tie_from_a_square() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    assert crossing(square) is None
    assert crossing(square[[0, 2, 1, 3]]) == (0, 2)


def test_sides_on_one_line_do_not_cross() -> None:
    """Whatever rounding makes of the angle between them."""
    share = np.linspace(0, 1, 8)[:, None]
    for heading in np.linspace(0.1, 3.0, 50):
        way = np.array([np.cos(heading), np.sin(heading)])
        there = share * way
        back = there[::-1] + 0.1 * np.array([-way[1], way[0]])
        assert crossing(np.concatenate([there, back])) is None
