from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.errors import InputError
from workbench.tracking import Axes

NAMES = ("x", "-x", "y", "-y", "z", "-z")
PAIRS = [(up, forward) for up in NAMES for forward in NAMES if up[-1] != forward[-1]]


def test_the_default_is_motives_y_up() -> None:
    point = np.array([1.0, 2.0, 3.0])
    np.testing.assert_array_equal(Axes().points_to_bench(point), [-3.0, -1.0, 2.0])


@pytest.mark.parametrize(("up", "forward"), PAIRS)
def test_every_pair_is_a_rotation_and_can_be_undone(up: str, forward: str) -> None:
    axes = Axes(up, forward)
    matrix = axes.export_to_bench
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    np.testing.assert_array_equal(matrix @ matrix.T, np.eye(3))
    points = np.random.default_rng(1).normal(size=(4, 5, 3))
    np.testing.assert_array_equal(axes.points_to_export(axes.points_to_bench(points)), points)


def test_up_becomes_z_and_forward_becomes_x() -> None:
    axes = Axes(up="-x", forward="y")
    np.testing.assert_array_equal(axes.points_to_bench(np.array([-1.0, 0, 0])), [0, 0, 1])
    np.testing.assert_array_equal(axes.points_to_bench(np.array([0, 1.0, 0])), [1, 0, 0])


@pytest.mark.parametrize(("up", "forward"), PAIRS)
def test_turned_points_agree_with_turned_quaternions(up: str, forward: str) -> None:
    axes = Axes(up, forward)
    turn = Rotation.from_rotvec([0.3, -0.7, 0.2])
    point = np.array([0.1, 0.5, -0.4])
    told = Rotation.from_quat(
        axes.quaternions_to_bench(turn.as_quat(scalar_first=True)), scalar_first=True
    )
    direct = axes.points_to_bench(turn.apply(point))
    np.testing.assert_allclose(told.apply(axes.points_to_bench(point)), direct, atol=1e-12)
    back = axes.quaternions_to_export(told.as_quat(scalar_first=True))
    np.testing.assert_allclose(back, turn.as_quat(scalar_first=True), atol=1e-12)


def test_parallel_and_unknown_axes_are_refused() -> None:
    with pytest.raises(InputError, match="forward '-y' is parallel to up 'y'"):
        Axes(up="y", forward="-y")
    with pytest.raises(InputError, match="axis up: 'w' is unknown; allowed are x, -x, y"):
        Axes(up="w")
