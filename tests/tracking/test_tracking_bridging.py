"""A point is carried on by offsets that have turned with the body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.tracking.body_position import locate_body
from workbench.tracking.bridging import bridge

OFFSETS = np.array([[0.05, 0.0, 0.0], [-0.03, 0.02, 0.0], [-0.02, -0.02, 0.0], [0.0, 0.0, 0.04]])
RATE = 120.0
SPEED = 8.0  # [rad/s]; at twice that the offsets turn too far in three samples
HIDDEN = slice(60, 63)


def turning() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return times (n,), a body's path (n, 3) and its markers' offsets (n, m, 3)."""
    t = np.arange(120) / RATE
    turned = Rotation.from_euler("y", SPEED * t[:, None]).as_matrix()
    offsets = np.einsum("nij,mj->nmi", turned, OFFSETS)
    path = np.column_stack([0.3 * t, 0.0 * t, 0.01 * np.sin(SPEED * t)])
    return t, path, offsets


def test_a_turning_body_is_carried_on_over_a_gap() -> None:
    t, path, offsets = turning()
    cloud, position = path[:, None] + offsets, path.copy()
    cloud[HIDDEN, 1:] = np.nan
    position[HIDDEN] = np.nan
    asked: list[int] = []

    def about(samples: NDArray[np.intp]) -> NDArray[np.float64]:
        asked.extend(samples)
        return offsets[samples]

    found = bridge(t, cloud, position, about)
    assert np.flatnonzero(found.bridged).tolist() == [60, 61, 62]
    assert 0 < found.error < 2e-3
    np.testing.assert_allclose(found.position, path, atol=2 * found.error)
    assert not set(asked) & {60, 61, 62}  # there nothing is told


def test_a_body_shown_by_one_marker_is_placed_by_its_pose_beside() -> None:
    t, path, offsets = turning()
    cloud = path[:, None] + offsets
    cloud[HIDDEN, 1:] = np.nan
    placed = locate_body("Foot", t, cloud, OFFSETS)
    assert placed is not None
    assert np.flatnonzero(placed.bridged).tolist() == [60, 61, 62]
    np.testing.assert_allclose(placed.position, path, atol=4e-3)
