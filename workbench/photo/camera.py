"""From pixels to the board's plane: a homography and the lens' distortion, fitted together.

The lens is Brown's: u, in half diagonals from the picture's centre, is seen at
u (1 + k1 |u|^2 + k2 |u|^4) + |u|^2 p + 2 u (u p). All come from the corners of the one photograph.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.photo.board import Board
from workbench.photo.markers import Corners

__all__ = ["Camera", "Viewpoint", "calibrate"]

Array = NDArray[np.float64]

_WORST_FIT_M = 0.00025  # rms on the paper; more, and no smooth lens explains the corners
_OUTLIER = 5.0  # robust deviations
_USUAL_FOCAL = 1.25  # half diagonals: a telephone's main camera, 26 mm on 36 x 24 mm film
_FOCAL_SIGMA = 0.5  # of its logarithm
_FOCALS = np.geomspace(0.4, 12.0, 200)
_HEIGHT_SIGMA = 0.1  # of its logarithm, when it is known from the strip's own scale
_SKEW = 0.004  # how far a fitted homography is from that of square pixels
_REJECTIONS = 2
_SHARPEST_PX = 0.02  # no corner is known better
_ROUNDS = 12
_LENS = slice(8, 12)  # of the parameters: k1, k2 and the two of p
_STRAIGHT = np.zeros(4)


@dataclass(frozen=True)
class Viewpoint:
    """Where the camera was.

    Args:
        below: (2,) the point of the board straight below it [m].
        height: above the board [m].
    """

    below: Array
    height: float


@dataclass(frozen=True, eq=False)
class Camera:
    """How the board's plane appears in one photograph.

    Args:
        numbers: (p,) eight of the homography from board to picture, k1, k2, the two of p, and for
            each further sheet its shift (2,) [m] and turn [rad] against the first.
        covariance: (p, p) of them [their units squared].
        centre: (2,) of the picture [pixel].
        half_diagonal: of the picture [pixel].
        origin: (2,) of the board that the homography is about [m].
        reach: half the pattern's height [m], the homography's unit.
        residual: rms of the corners on the paper [m].
        corners: how many were used.
    """

    numbers: Array
    covariance: Array
    centre: Array
    half_diagonal: float
    origin: Array
    reach: float
    residual: float = 0.0
    corners: int = 0

    @property
    def homography(self) -> Array:
        """Return the matrix from board to undistorted picture, (3, 3) [1]."""
        return np.append(self.numbers[:8], 1.0).reshape(3, 3)

    def to_pixels(self, positions: Array) -> Array:
        """Return where points of the board are seen, (..., 2) [pixel].

        Args:
            positions: (..., 2) on the board [m].
        """
        flat = _projected(self.homography, (positions - self.origin) / self.reach)
        return self.centre + self.half_diagonal * _bent(flat, self.numbers[_LENS])

    def to_board(self, pixels: Array) -> Array:
        """Return the points of the board that are seen, (..., 2) [m].

        Args:
            pixels: (..., 2) where they are seen [pixel].
        """
        seen = (pixels - self.centre) / self.half_diagonal
        flat = seen
        back = np.linalg.inv(self.homography).astype(np.float64)
        for _ in range(_ROUNDS):
            flat = flat + seen - _bent(flat, self.numbers[_LENS])
        return self.origin + self.reach * _projected(back, flat)

    def viewpoint(self, height: float | None = None) -> Viewpoint:
        """Return where the camera was, if its pixels are square and its centre the picture's.

        A plane seen squarely does not determine the focal length; so a height that is known from
        something else decides, and without one an everyday focal length is assumed.

        Args:
            height: of the camera above the board [m].
        """
        trial = [self._seen_from(focal) for focal in _FOCALS]
        doubt = [_unlikely(self.homography, focal) for focal in _FOCALS]
        if height is not None:
            doubt = [
                one + (np.log(view.height / height) / _HEIGHT_SIGMA) ** 2
                for one, view in zip(doubt, trial, strict=True)
            ]
        return trial[int(np.argmin(doubt))]

    def _seen_from(self, focal: float) -> Viewpoint:
        """Return the viewpoint for a focal length [half diagonals]."""
        turned = np.diag([1 / focal, 1 / focal, 1.0]) @ self.homography
        turned /= np.sqrt(np.linalg.norm(turned[:, 0]) * np.linalg.norm(turned[:, 1]))
        across, along, shift = turned.T
        square = np.column_stack([across, along, np.cross(across, along)])
        eye = -np.linalg.solve(square, shift)
        return Viewpoint(self.origin + self.reach * eye[:2], float(self.reach * abs(eye[2])))

    def changed(self, numbers: Array) -> Camera:
        """Return the same camera with other numbers.

        Args:
            numbers: (p,) of `Camera` [m, rad, 1].
        """
        return Camera(
            numbers, self.covariance, self.centre, self.half_diagonal, self.origin, self.reach
        )


def calibrate(
    name: str, corners: Corners, size: tuple[int, int], printed: tuple[float, float] = (1.0, 1.0)
) -> Camera:
    """Return the camera that saw a board's corners.

    Args:
        name: of the photograph, for messages.
        corners: that were seen.
        size: columns and rows of the picture [pixel].
        printed: what a metre of the board's width and height became on paper [m].

    Raises:
        InputError: when no camera with such a lens sees the corners there.
    """
    board = corners.board
    positions = board.corners[corners.number] * np.array(printed)
    sheets = board.corner_sheets[corners.number]
    centre, half_diagonal = (np.array(size) - 1) / 2, float(np.hypot(*size)) / 2
    origin, reach = board.size / 2, float(board.size[1]) / 2
    blank = Camera(np.zeros(0), np.zeros((0, 0)), centre, half_diagonal, origin, reach)
    seen = (corners.pixels - centre) / half_diagonal
    start = _first_homography((positions - origin) / reach, seen)
    numbers = np.concatenate([start, _STRAIGHT, np.zeros(3 * (board.sheets - 1))])

    def misses(trial: Array) -> Array:
        joined = _joined(positions, sheets, trial, board)
        return blank.changed(trial).to_pixels(joined) - corners.pixels

    kept = np.ones(len(positions), dtype=bool)
    for _ in range(_REJECTIONS):
        numbers = _solved(misses, numbers, kept)[0]
        off = np.linalg.norm(misses(numbers), axis=1)
        kept = off < _OUTLIER * max(float(np.median(off[kept])), _SHARPEST_PX)
    numbers, covariance = _solved(misses, numbers, kept)
    joined = _joined(positions, sheets, numbers, board)
    error = (blank.changed(numbers).to_board(corners.pixels) - joined)[kept]
    residual = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    count = int(kept.sum())
    _require_fit(name, residual, count, len(kept))
    return Camera(numbers, covariance, centre, half_diagonal, origin, reach, residual, count)


def _solved(
    misses: Callable[[Array], Array], start: Array, kept: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return the numbers that miss the kept corners least, and their covariance."""
    solution = scipy.optimize.least_squares(
        lambda trial: misses(trial)[kept].ravel(), start, x_scale="jac", method="lm"
    )
    free = max(solution.fun.size - len(start), 1)
    variance = float(solution.fun @ solution.fun) / free
    return solution.x, np.linalg.pinv(solution.jac.T @ solution.jac) * variance


def _require_fit(name: str, residual: float, kept: int, seen: int) -> None:
    if residual > _WORST_FIT_M or kept < 0.8 * seen:
        raise InputError(
            f"{name}: the board's corners lie {1000 * residual:.2f} mm rms off after the lens is "
            f"straightened ({kept} of {seen} corners agree), {1000 * _WORST_FIT_M:g} mm is "
            "allowed; tape the paper flat, do not crop the photograph, use the main lens and no "
            "panorama or wide angle"
        )


def _joined(positions: Array, sheets: NDArray[np.int_], numbers: Array, board: Board) -> Array:
    """Return the corners as the sheets were joined, (n, 2) [m]."""
    joined = positions.copy()
    for sheet in range(1, board.sheets):
        dx, dy, turn = numbers[_LENS.stop + 3 * (sheet - 1) :][:3]
        of_sheet = sheets == sheet
        pivot = np.array([board.size[0] / 2, sheet * board.rows_a_sheet * board.square])
        spun = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        joined[of_sheet] = pivot + (positions[of_sheet] - pivot) @ spun.T + [dx, dy]
    return joined


def _first_homography(positions: Array, seen: Array) -> Array:
    """Return the eight numbers of the homography from places to seen by linear least squares."""
    x, y = positions.T
    u, v = seen.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    rows = np.concatenate(
        [
            np.column_stack([x, y, one, zero, zero, zero, -u * x, -u * y]),
            np.column_stack([zero, zero, zero, x, y, one, -v * x, -v * y]),
        ]
    )
    return np.linalg.lstsq(rows, np.concatenate([u, v]), rcond=None)[0]


def _projected(matrix: Array, positions: Array) -> Array:
    mapped = positions @ matrix[:, :2].T + matrix[:, 2]
    return mapped[..., :2] / mapped[..., 2:]


def _bent(flat: Array, lens: Array) -> Array:
    """Return where the lens puts undistorted places, (..., 2) [half diagonals]."""
    square = np.sum(flat**2, axis=-1, keepdims=True)
    stretch = 1 + lens[0] * square + lens[1] * square**2
    return flat * (stretch + 2 * (flat @ lens[2:])[..., None]) + square * lens[2:]


def _unlikely(homography: Array, focal: float) -> float:
    """Return how unlikely a focal length [half diagonals] is: by the plane, and as such."""
    across, along, _ = (np.diag([1 / focal, 1 / focal, 1.0]) @ homography).T
    scale = across @ across + along @ along
    skew = 2 * (across @ along) / scale, (across @ across - along @ along) / scale
    return float(
        np.sum(np.square(skew)) / _SKEW**2 + (np.log(focal / _USUAL_FOCAL) / _FOCAL_SIGMA) ** 2
    )
