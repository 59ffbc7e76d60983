"""Find the strip in a photograph of the board: its path from one end to the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.noise import robust_sigma
from workbench.photo.board import Board
from workbench.photo.camera import Camera
from workbench.photo.opencv import opencv

__all__ = ["TAPES", "StripView", "find_path", "make_view"]

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

TAPES: dict[str, tuple[float, float, float]] = {
    "none": (0.2, 0.6, 0.2),
    "blue": (-0.5, -0.5, 1.0),
    "green": (-0.5, 1.0, -0.5),
    "red": (1.0, -0.5, -0.5),
    "yellow": (0.5, 0.5, -1.0),
}
"""What marks the strip -> weights of red, green and blue; bare aluminium is bright."""

_FINEST_PER_M = 5000.0  # pixels of the straightened field
_WIDEST_M = 0.007  # a strip with its visible side; wider bright things are not it
_THRESHOLD = 0.3  # of the strip's usual strength above the field
_STRENGTH = 99.6  # percentile of the field that is surely strip
_FAINTEST = 8.0  # the strip's strength over the field's noise
_JOIN_M = 0.004  # gaps that are closed
_RIM_M = 0.001
_SHORTEST = 0.85  # of the strip's length, that must be seen
_LONGEST = 1.15
_LINEAR = np.where(
    np.arange(256) <= 10,
    np.arange(256) / 255 / 12.92,
    ((np.arange(256) / 255 + 0.055) / 1.055) ** 2.4,
).astype(np.float32)  # IEC 61966-2-1: from stored bytes to light


@dataclass(frozen=True, eq=False)
class StripView:
    """A photograph as far as the strip is concerned.

    Args:
        name: of the photograph, for messages.
        strength: (rows, columns) how much each pixel looks like strip, linear in light [1].
        camera: that saw it.
        board: on which the strip lies.
        side: -1 where the board's x is turned round, so that a strip that lies on its other edge
            has its drawn shape, else 1.
        height: of the camera above the board, where it is known [m].
    """

    name: str
    strength: Picture
    camera: Camera
    board: Board
    side: float = 1.0
    height: float | None = None

    def at(self, positions: Array) -> Picture:
        """Return the strength at points of the board, (n, m) [1].

        Args:
            positions: (n, m, 2) on the board [m].
        """
        cv2 = opencv()
        pixels = self.camera.to_pixels(positions * [self.side, 1.0]).astype(np.float32)
        return cv2.remap(self.strength, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR)

    def below(self) -> tuple[Array, float]:
        """Return the point straight below the camera, (2,) [m], and the camera's height [m]."""
        viewpoint = self.camera.viewpoint(self.height)
        return viewpoint.below * [self.side, 1.0], viewpoint.height

    def shifts(self, positions: Array) -> Array:
        """Return how places move with the camera's numbers, (p, n, 2) [m by the unit of each].

        Args:
            positions: (n, 2) on the board [m].
        """
        pixels = self.camera.to_pixels(positions * [self.side, 1.0])
        steps = 0.1 * np.sqrt(np.diag(self.camera.covariance))
        here = self.camera.to_board(pixels)
        moved = [
            (self.camera.changed(self.camera.numbers + step * one).to_board(pixels) - here) / step
            for one, step in zip(np.eye(len(steps)), steps, strict=True)
        ]
        return np.array(moved) * [self.side, 1.0]


def make_view(
    name: str, photo: NDArray[np.uint8], camera: Camera, board: Board, tape: str
) -> StripView:
    """Return the view of a photograph.

    Args:
        name: of the photograph.
        photo: (rows, columns, 3) blue, green, red.
        camera: that took it.
        board: that it shows.
        tape: key of `TAPES`.

    Raises:
        InputError: when the field is not wholly in the photograph.
    """
    red, green, blue = TAPES[tape]
    strength = opencv().transform(_LINEAR[photo], np.array([[blue, green, red]], dtype=np.float32))
    low, high = board.field
    edge = camera.to_pixels(np.array([low, [low[0], high[1]], high, [high[0], low[1]]]))
    rows, columns = photo.shape[:2]
    if edge.min() < 0 or (edge > [columns - 1, rows - 1]).any():
        raise InputError(f"{name}: part of the free field lies outside; photograph the whole board")
    return StripView(name, strength.reshape(rows, columns), camera, board)


def find_path(view: StripView, length: float) -> Array:
    """Return the strip's middle from one end to the other, (n, 2) on the board [m], rough.

    Args:
        view: of the photograph.
        length: of the strip [m].

    Raises:
        InputError: when no strip is found or part of it is hidden or outside the field.
    """
    cv2 = opencv()
    low, high = view.board.field
    fine = min(_FINEST_PER_M, _resolution(view))
    columns, rows = ((high - low) * fine).astype(int)
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1) / fine + low
    mask = _mask(view, view.at(grid), fine)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        raise _not_found(view.name)
    spans = np.hypot(stats[1:, cv2.CC_STAT_WIDTH], stats[1:, cv2.CC_STAT_HEIGHT])
    largest = 1 + int(np.argmax(spans))
    left, top, wide, tall = stats[largest, :4]
    free = min(left, top, columns - left - wide, rows - top - tall)
    one = (labels == largest).astype(np.uint8)
    path = _longest_path(cv2.ximgproc.thinning(255 * one)) / fine + low
    seen = float(np.sum(np.linalg.norm(np.diff(path[::5], axis=0), axis=1)))
    if seen < length / 4:
        raise _not_found(view.name)
    if free <= round(_RIM_M * fine):
        raise InputError(
            f"{view.name}: the strip is cut off at the field's border; lay all of it on the dark "
            "field, on the board's foot line if it is long, and photograph it from farther away"
        )
    if not _SHORTEST * length < seen < _LONGEST * length:
        raise InputError(
            f"{view.name}: {1000 * seen:.0f} mm of strip are seen, {1000 * length:.0f} mm are "
            "expected; nothing else bright may lie on the field and no part of the strip be "
            "hidden; a coloured tape on its edge (--tape) helps against shadow and glare"
        )
    return path


def _resolution(view: StripView) -> float:
    """Return the photograph's pixels per metre in the field's middle."""
    middle = view.board.size / 2
    pixels = view.camera.to_pixels(middle + np.array([[0.0, 0.0], [0.01, 0.0]]))
    return float(np.linalg.norm(pixels[1] - pixels[0])) / 0.01


def _mask(view: StripView, field: Picture, fine: float) -> NDArray[np.uint8]:
    """Return 255 where the straightened field shows strip."""
    cv2 = opencv()
    smooth = cv2.GaussianBlur(field, (0, 0), max(0.8, 0.0002 * fine))
    above = cv2.morphologyEx(smooth, cv2.MORPH_TOPHAT, _disc(_WIDEST_M * fine))
    strength = float(np.percentile(above, _STRENGTH))
    noise = float(robust_sigma(above, centred=True))
    if strength < max(_FAINTEST * noise, 0.02):
        raise _not_found(view.name)
    mask = (above > _THRESHOLD * strength).astype(np.uint8) * 255
    rim = max(1, round(_RIM_M * fine))
    mask[:rim], mask[-rim:], mask[:, :rim], mask[:, -rim:] = 0, 0, 0, 0
    pad = round(_JOIN_M * fine)  # or closing would join the strip to the field's edge
    closed = cv2.morphologyEx(np.pad(mask, pad), cv2.MORPH_CLOSE, _disc(_JOIN_M * fine))
    return np.ascontiguousarray(closed[pad:-pad, pad:-pad])


def _disc(diameter: float) -> NDArray[np.uint8]:
    cv2 = opencv()
    size = 2 * max(1, round(diameter / 2)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))


def _longest_path(skeleton: NDArray[np.uint8]) -> Array:
    """Return the pixels of a skeleton from one far end to the other, (n, 2) columns and rows."""
    rows, columns = np.nonzero(skeleton)
    number = np.full(skeleton.shape, -1)
    number[rows, columns] = np.arange(len(rows))
    padded = np.pad(number, 1, constant_values=-1)
    pairs = [
        np.column_stack([np.arange(len(rows)), padded[rows + 1 + r, columns + 1 + c],
                         np.full(len(rows), np.hypot(r, c))])
        for r, c in ((0, 1), (1, 0), (1, 1), (1, -1))
    ]  # fmt: skip
    links = np.concatenate(pairs)
    links = links[links[:, 1] >= 0]
    ends = links[:, :2].astype(int)
    graph = scipy.sparse.coo_array(
        (links[:, 2], (ends[:, 0], ends[:, 1])), shape=(len(rows), len(rows))
    ).tocsr()
    first = _farthest(scipy.sparse.csgraph.dijkstra(graph, directed=False, indices=0))
    distance, before = scipy.sparse.csgraph.dijkstra(
        graph, directed=False, indices=first, return_predecessors=True
    )
    node, path = _farthest(distance), []
    while node >= 0:
        path.append(node)
        node = int(before[node])
    return np.column_stack([columns[path], rows[path]]).astype(float)


def _farthest(distance: Array) -> int:
    return int(np.argmax(np.where(np.isfinite(distance), distance, -1.0)))


def _not_found(name: str) -> InputError:
    return InputError(
        f"{name}: no strip is found on the dark field; lay it there on its edge, lit from above, "
        "or put a coloured tape on the edge and name it with --tape"
    )
