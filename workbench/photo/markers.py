"""Find the board in a photograph: which one it is, and where its corners lie in pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.photo.board import BOARDS, Board
from workbench.photo.opencv import opencv

__all__ = ["Corners", "find_corners"]

Array = NDArray[np.float64]

_FEWEST_MARKERS = 12
_FEWEST_CORNERS = 40
_LEAST_COVERAGE = 0.7  # of the pattern's area, that the corners seen must span
_RANSAC_M = 0.004  # on the paper, for a lens that is not straightened yet
_LEAST_FITTING = 0.7  # of the markers must lie as on the board
_NEIGHBOURS = 4  # markers that say where a corner is sought
_NEAR = 6.0  # squares, to the nearest of them
_WINDOW = 0.2  # of a square, half the side of what a corner is found in: up to the markers' bits
_FARTHEST = 0.25  # of a square, from where its neighbours say that it is
_SHARP = 0.08  # of the contrast from one pixel to the next, at a sharp photograph's edges


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of a board seen in a photograph.

    Args:
        board: which one.
        number: (n,) of each corner on the board.
        pixels: (n, 2) where it is seen, columns and rows [pixel].
    """

    board: Board
    number: NDArray[np.int_]
    pixels: Array


def find_corners(name: str, grey: NDArray[np.uint8]) -> Corners:
    """Return the corners of the board in a photograph.

    Args:
        name: of the photograph, for messages.
        grey: (rows, columns) brightness.

    Raises:
        InputError: when there are no markers or too few, when they are another board's, and when
            the photograph is mirrored or blurred.
    """
    numbers, seen = _markers(grey)
    board = _recognised(name, grey, numbers)
    on_board = (numbers >= board.first_marker) & (numbers < board.first_marker + len(board.marked))
    numbers, seen = numbers[on_board] - board.first_marker, seen[on_board]
    numbers, seen = _consistent(name, board, numbers, seen)
    corners = _refined(board, grey, numbers, seen)
    _require_coverage(name, corners)
    return corners


def _markers(grey: NDArray[np.uint8]) -> tuple[NDArray[np.int_], Array]:
    """Return numbers (n,) and corners (n, 4, 2) of all markers."""
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
    settings = cv2.aruco.DetectorParameters()
    settings.adaptiveThreshWinSizeMax = 43
    settings.adaptiveThreshWinSizeStep = 6
    settings.minMarkerPerimeterRate = 0.005
    settings.perspectiveRemoveIgnoredMarginPerCell = 0.3
    found, numbers, _ = cv2.aruco.ArucoDetector(dictionary, settings).detectMarkers(grey)
    if numbers is None:
        return np.empty(0, dtype=int), np.empty((0, 4, 2))
    return numbers.ravel().astype(int), np.array(found, dtype=float).reshape(-1, 4, 2)


def _recognised(name: str, grey: NDArray[np.uint8], numbers: NDArray[np.int_]) -> Board:
    counts = {paper: _count(board, numbers) for paper, board in BOARDS.items()}
    paper = max(counts, key=lambda one: counts[one])
    if counts[paper] >= _FEWEST_MARKERS and counts[paper] >= _LEAST_FITTING * len(numbers):
        return BOARDS[paper]
    if _blurred(grey):
        raise InputError(
            f"{name}: the photograph is blurred; hold the camera still, focus on the board and "
            "take more light"
        )
    flipped, _ = _markers(np.ascontiguousarray(grey[:, ::-1]))
    if max(_count(board, flipped) for board in BOARDS.values()) >= _FEWEST_MARKERS:
        raise InputError(
            f"{name}: the photograph is mirrored; turn off the camera's mirroring, or flip it back"
        )
    if counts[paper]:
        raise InputError(
            f"{name}: only {counts[paper]} of the board's {len(BOARDS[paper].marked)} markers are "
            f"seen, {_FEWEST_MARKERS} are needed; photograph the whole board, evenly lit, and "
            "nothing on its border"
        )
    if len(numbers):
        raise InputError(
            f"{name}: the {len(numbers)} markers seen are of another board; print one with "
            "`workbench template board`"
        )
    raise InputError(
        f"{name}: no markers are seen; lay the strip on the board of `workbench template board` "
        "and photograph all of it"
    )


def _count(board: Board, numbers: NDArray[np.int_]) -> int:
    on_board = (numbers >= board.first_marker) & (numbers < board.first_marker + len(board.marked))
    return int(on_board.sum())


def _blurred(grey: NDArray[np.uint8]) -> bool:
    """Return whether no edge in the photograph is sharp."""
    bright = grey.astype(np.float32)
    step = np.abs(np.diff(bright, axis=1))
    contrast = float(np.percentile(bright[::4, ::4], 99) - np.percentile(bright[::4, ::4], 1))
    return float(np.percentile(step, 99.9)) < _SHARP * contrast


def _consistent(
    name: str, board: Board, numbers: NDArray[np.int_], seen: Array
) -> tuple[NDArray[np.int_], Array]:
    """Return the markers that lie as on the board."""
    cv2 = opencv()
    positions = board.marker_corners()[numbers]
    _, fits = cv2.findHomography(
        seen.reshape(-1, 2), positions.reshape(-1, 2), cv2.RANSAC, _RANSAC_M
    )
    kept = np.zeros(len(numbers), dtype=bool)
    if fits is not None:
        kept = fits.reshape(-1, 4).all(axis=1)
    if kept.sum() < max(_FEWEST_MARKERS, _LEAST_FITTING * len(numbers)):
        raise InputError(
            f"{name}: the markers seen do not lie as on the board for {board.paper}; it is another "
            "board, or the paper is not flat: print it with `workbench template board` and tape it "
            "to a plate"
        )
    return numbers[kept], seen[kept]


def _refined(
    board: Board, grey: NDArray[np.uint8], numbers: NDArray[np.int_], seen: Array
) -> Corners:
    """Return the corners with markers nearby, to a fraction of a pixel."""
    cv2 = opencv()
    positions = board.marker_corners()[numbers]
    away = np.linalg.norm(board.corners[:, None] - positions.mean(axis=1)[None], axis=-1)
    near = np.argsort(away, axis=1)[:, :_NEIGHBOURS]
    number = np.flatnonzero(away.min(axis=1) < _NEAR * board.square)
    guess = np.array([_beside(positions[near[k]], seen[near[k]], board.corners[k]) for k in number])
    side = np.linalg.norm(seen[:, 0] - seen[:, 1], axis=1)
    square = float(np.median(side)) * board.square / board.marker
    window = max(2, round(_WINDOW * square))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
    inside = ((guess > window) & (guess < np.array(grey.shape[::-1]) - 1 - window)).all(axis=1)
    number = number[inside]
    if not len(number):
        return Corners(board, number, np.empty((0, 2)))
    start = guess[inside].astype(np.float32)[:, None]
    found = cv2.cornerSubPix(grey, start.copy(), (window, window), (-1, -1), stop)
    moved = np.linalg.norm((found - start).reshape(-1, 2), axis=1)
    kept = moved < _FARTHEST * square
    return Corners(board, number[kept], found.reshape(-1, 2)[kept].astype(float))


def _beside(positions: Array, seen: Array, corner: Array) -> Array:
    """Return where a corner is, (2,) in pixels, by the markers beside it (m, 4, 2)."""
    cv2 = opencv()
    found, _ = cv2.findHomography(positions.reshape(-1, 2), seen.reshape(-1, 2))
    if found is None:
        return seen.reshape(-1, 2).mean(axis=0)
    mapped = found @ [*corner, 1.0]
    return mapped[:2] / mapped[2]


def _require_coverage(name: str, corners: Corners) -> None:
    board = corners.board
    few = len(corners.number) < _FEWEST_CORNERS
    if not few:
        positions = board.corners[corners.number]
        share = np.prod(np.ptp(positions, axis=0)) / np.prod(np.ptp(board.corners, axis=0))
        few = share < _LEAST_COVERAGE
    if few:
        raise InputError(
            f"{name}: only {len(corners.number)} of the board's {len(board.corners)} corners are "
            "seen, too few or all on one side; photograph the whole board, evenly lit, and nothing "
            "on its border"
        )
