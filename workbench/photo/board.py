"""The marker board as data: writer and reader both take it from here.

A ring of two rows of chess squares, every white one with a marker (ChArUco), runs round a dark free
field. Board coordinates are in metres: x to the right, y up the page, the origin at the pattern's
lower left corner. The free field is dark so that bare aluminium stands out on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean

__all__ = ["BOARDS", "FOOT_TURN_RAD", "Board", "find_board"]

Array = NDArray[np.float64]

FOOT_TURN_RAD = np.radians(8.0)
"""How far the board's foot line is turned, so that the beam's tall box fits the field."""


@dataclass(frozen=True)
class Board:
    """A marker board.

    Args:
        paper: name of the sheets it is printed on.
        columns: of chess squares.
        rows: of chess squares.
        square: side of a square [m].
        marker: side of a marker [m].
        border: how many squares wide the ring is.
        sheets: how many, one above the other, each with the same number of rows.
        sheet_size: (width, height) [m].
        first_marker: number of the first marker in the dictionary of 1000 with 4 x 4 bits.
    """

    paper: str
    columns: int
    rows: int
    square: float
    marker: float
    border: int
    sheets: int
    sheet_size: tuple[float, float]
    first_marker: int

    @property
    def size(self) -> Array:
        """Return width and height of the pattern, (2,) [m]."""
        return self.square * np.array([self.columns, self.rows])

    @property
    def field(self) -> tuple[Array, Array]:
        """Return the lower left and the upper right corner of the free field, (2,) each [m]."""
        inset = self.border * self.square
        return np.full(2, inset), self.size - inset

    @property
    def rows_a_sheet(self) -> int:
        """Return how many rows of squares a sheet carries."""
        return self.rows // self.sheets

    @cached_property
    def squares(self) -> NDArray[np.int_]:
        """Return column and row, from below, of the ring's squares, (n, 2)."""
        column, row = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        across = np.minimum(column, self.columns - 1 - column)
        along = np.minimum(row, self.rows - 1 - row)
        ring = np.minimum(across, along) < self.border
        return np.stack([column[ring], row[ring]], axis=-1)

    @cached_property
    def marked(self) -> NDArray[np.int_]:
        """Return column and row of the white squares; the n-th has marker n, (n, 2)."""
        return self.squares[self.squares.sum(axis=1) % 2 == 1]

    @cached_property
    def corners(self) -> Array:
        """Return where four squares of one sheet meet, (n, 2) [m]."""
        return (self.square * self._crossings).astype(np.float64)

    @cached_property
    def corner_sheets(self) -> NDArray[np.int_]:
        """Return the sheet of each corner, from below, (n,)."""
        return (self._crossings[:, 1] - 1) // self.rows_a_sheet

    @cached_property
    def _crossings(self) -> NDArray[np.int_]:
        ring = {(int(c), int(r)) for c, r in self.squares}
        found = [
            (c, r)
            for c, r in ring
            if {(c - 1, r - 1), (c - 1, r), (c, r - 1)} <= ring and r % self.rows_a_sheet
        ]
        return np.array(sorted(found, key=lambda position: (position[1], position[0])))

    def marker_corners(self) -> Array:
        """Return each marker's corners, (n, 4, 2) [m], from upper left clockwise."""
        middle = (self.square * (self.marked + 0.5)).astype(np.float64)
        half = self.marker / 2
        return middle[:, None] + half * np.array(
            [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
        )

    def sheet_of(self, points: Array) -> NDArray[np.int_]:
        """Return the sheet, from below, that each point lies on, (n,).

        Args:
            points: (n, 2) on the board [m].
        """
        height = self.square * self.rows_a_sheet
        return np.clip(points[:, 1] // height, 0, self.sheets - 1).astype(int)


_A3 = Board("A3", 35, 50, 0.008, 0.006, 2, 1, (0.297, 0.420), 0)
_A4 = Board("A4", 35, 50, 0.008, 0.006, 2, 2, (0.297, 0.210), 500)

BOARDS = {board.paper: board for board in (_A3, _A4)}
"""Boards by paper; that of A4 is two sheets, and reading measures how they were joined."""


def find_board(paper: str) -> Board:
    """Return the board for a paper.

    Raises:
        InputError: when there is none; lists those that exist.
    """
    by_name = {name.casefold(): board for name, board in BOARDS.items()}
    board = by_name.get(paper.casefold())
    if board is None:
        raise InputError(
            f"no board for paper {paper!r}{did_you_mean(paper, BOARDS)}; "
            f"there are {', '.join(BOARDS)}"
        )
    return board
