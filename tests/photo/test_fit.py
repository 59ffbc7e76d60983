"""The fit of arcs: exact on exact points, honest about noisy ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.photo.rendering import TARGET, thesis_angles
from workbench.photo.fit import StripPoints, fit_strip
from workbench.photo.orient import oriented, rough_numbers
from workbench.shape import equal_length_arcs

LENGTH, HALF = 0.615, 0.001
NOISE = 5e-5


def drawn(noise: np.ndarray | float, scale: float = 1.02) -> StripPoints:
    arcs = equal_length_arcs(thesis_angles, LENGTH * scale).moved(0.3, (0.1, 0.2))
    along = np.linspace(0.0005, arcs.length - 0.0005, 1200)
    sides = np.where(along < 0.3, 1.0, -1.0)
    places = arcs.points_at(along) + (sides * HALF + noise)[:, None] * arcs.normals_at(along)
    ends = arcs.points_at([0.0, arcs.length])
    return StripPoints(places, sides, ends, np.full(2, 3e-4), (HALF, 1.5e-4))


def fitted(points: StripPoints) -> tuple[np.ndarray, np.ndarray]:
    start = rough_numbers(points.positions, LENGTH, HALF)
    fit = fit_strip(points, LENGTH, start, thesis_angles[1:])
    off = fit.angles - thesis_angles
    off[0] += 0.3  # turned counter-clockwise by that
    return off, np.sqrt(np.diag(fit.covariance))[2:18]


def test_exact_points_give_the_exact_angles() -> None:
    off, _ = fitted(drawn(0.0))
    assert np.degrees(off) == pytest.approx(np.zeros(16), abs=1e-3)


@pytest.mark.parametrize("reach", [0, pytest.param(3, marks=pytest.mark.long)])
def test_errors_are_as_large_as_they_are_said_to_be(reach: int) -> None:
    """Neighbouring points that err alike are not taken for independent ones."""
    generator = np.random.default_rng(5)
    pulls = []
    for _ in range(10):
        noise = generator.normal(size=1200)
        if reach:
            noise = gaussian_filter1d(noise, reach)
        off, error = fitted(drawn(NOISE * noise / noise.std()))
        pulls.append(off / error)
    assert 0.75 < np.sqrt(np.mean(np.square(pulls))) < 1.3


def test_a_glaring_stretch_does_not_bend_the_strip() -> None:
    noise = np.random.default_rng(1).normal(0, NOISE, 1200)
    noise[500:520] += 4e-4  # 10 mm
    off, _ = fitted(drawn(noise))
    assert np.degrees(np.abs(off)).max() < 0.3


def test_root_and_tip_are_told_by_the_target() -> None:
    points = drawn(0.0)
    target = np.array(TARGET.angles)
    for given, mirrored in (
        (points, False),
        (points.reversed(), False),
        (points.mirrored().reversed(), True),
    ):
        found, was = oriented("x", given, LENGTH, target, None)
        assert was is mirrored
        assert found.ends == pytest.approx(points.ends)
        assert found.sides == pytest.approx(points.sides)
