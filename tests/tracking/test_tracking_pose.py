from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.tracking.pose import fit_poses, pitch_of

PLACES = np.array([[120, -110, 12], [120, 110, 12], [-120, -110, 12], [-120, 110, 12]]) * 1e-3


def moved(n: int, noise: float) -> tuple[np.ndarray, Rotation, np.ndarray]:
    rng = np.random.default_rng(5)
    turn = Rotation.from_rotvec(rng.normal(0, 0.5, (n, 3)))
    origin = rng.normal(0, 1, (n, 3))
    cloud = np.einsum("nij,mj->nmi", turn.as_matrix(), PLACES) + origin[:, None]
    return cloud + rng.normal(0, noise, cloud.shape), turn, origin


def test_exact_markers_give_the_exact_pose() -> None:
    cloud, turn, origin = moved(30, 0.0)
    poses = fit_poses(PLACES, cloud)
    np.testing.assert_allclose(poses.matrix, turn.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(poses.origin, origin, atol=1e-12)
    assert poses.rmsd.max() < 1e-12


def test_the_fit_is_that_of_scipy() -> None:
    cloud, _, _ = moved(20, 2e-3)
    poses = fit_poses(PLACES, cloud)
    for i, seen in enumerate(cloud):
        turn, misfit = Rotation.align_vectors(seen - seen.mean(0), PLACES - PLACES.mean(0))[:2]
        np.testing.assert_allclose(poses.matrix[i], turn.as_matrix(), atol=1e-9)
        assert abs(poses.rmsd[i] - misfit / 2) < 1e-9


def test_the_weighted_fit_is_that_of_scipy() -> None:
    cloud, _, _ = moved(20, 2e-3)
    weights = np.array([1.0, 0.2, 3.0, 0.5])
    share = weights / weights.sum()
    poses = fit_poses(PLACES, cloud, weights)
    for i, seen in enumerate(cloud):
        turn, misfit = Rotation.align_vectors(
            seen - share @ seen, PLACES - share @ PLACES, weights=weights
        )[:2]
        np.testing.assert_allclose(poses.matrix[i], turn.as_matrix(), atol=1e-9)
        assert abs(poses.rmsd[i] - misfit / np.sqrt(weights.sum())) < 1e-9


@pytest.mark.parametrize("flatness", [1.0, 0.1, 0.02])
def test_half_turns_and_narrow_bodies_are_fitted_as_well(flatness: float) -> None:
    places = PLACES * [1, flatness, 1] + [[0, 0, 0.01 * flatness * k] for k in range(4)]
    turn = Rotation.from_rotvec(np.pi * np.vstack([np.eye(3), -np.eye(3), np.zeros(3)]))
    cloud = np.einsum("nij,mj->nmi", turn.as_matrix(), places)
    np.testing.assert_allclose(fit_poses(places, cloud).matrix, turn.as_matrix(), atol=1e-8)


def test_a_hidden_marker_does_not_move_the_origin() -> None:
    cloud, _, origin = moved(10, 0.0)
    cloud[3:7, 2] = np.nan
    np.testing.assert_allclose(fit_poses(PLACES, cloud).origin, origin, atol=1e-12)


def test_two_markers_or_markers_on_a_line_give_no_pose() -> None:
    cloud, _, _ = moved(4, 0.0)
    cloud[1, :2] = np.nan
    assert np.isnan(fit_poses(PLACES, cloud).origin).any(axis=1).tolist() == [
        False,
        True,
        False,
        False,
    ]
    line = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
    assert np.isnan(fit_poses(line, line[None]).origin).all()


def test_mirrored_markers_give_a_rotation_with_a_poor_fit() -> None:
    places = np.array([[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [0, 0, 0]])
    poses = fit_poses(places, (places * [1, 1, -1])[None])
    assert np.linalg.det(poses.matrix[0]) > 0.99
    assert poses.rmsd[0] > 1e-2


def test_pitch_turns_x_towards_minus_z() -> None:
    turn = Rotation.from_rotvec([[0, 0.2, 0], [0, -1.0, 0]])
    np.testing.assert_allclose(pitch_of(turn.as_matrix()[:, :, 0]), [0.2, -1.0])


def test_samples_are_fitted_to_the_markers_that_each_of_them_shows() -> None:
    cloud, turn, origin = moved(40, 0.0)
    cloud[::3, 0] = np.nan
    cloud[::4, 2] = np.inf  # is not seen either
    poses = fit_poses(PLACES, cloud)
    some = np.arange(40) % 12 > 0  # two markers give no pose
    assert (np.isfinite(poses.rmsd) == some).all()
    np.testing.assert_allclose(poses.matrix[some], turn.as_matrix()[some], atol=1e-12)
    np.testing.assert_allclose(poses.origin[some], origin[some], atol=1e-12)
