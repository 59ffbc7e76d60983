"""Spread a drawing over the fewest pages: how it is turned, where they lie, what they share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from workbench.template.drawing import Placement, draw_lines, draw_strip
from workbench.template.figure import Drawing
from workbench.template.paper import OVERLAP_MM, Paper
from workbench.template.strip import Strip

__all__ = ["BORDER_MM", "Mark", "PageLayout", "Tile", "lay_out"]

Array = NDArray[np.float64]
Cell = tuple[int, int]
"""Column from the left and row from the bottom."""
_Rank = tuple[int, float, int, int, float]

_TURNS_DEG = tuple(range(-89, 91))
_ALIGNMENTS = (0.5, 0.0, 1.0)  # where the drawing lies in what room the pages have to spare
_MARKS_AT = ((0.2, 0.1, 0.3, 0.4), (0.8, 0.9, 0.7, 0.6))  # of an edge's length, the best first
_MARK_CLEAR_MM = 8.0  # between a mark and the drawing
_COARSE_MM = 4.0  # between the points that sample the drawing in the first look
BORDER_MM = 1.0
"""Between the drawing and the edge of its pages."""


@dataclass(frozen=True)
class Tile:
    """A page's part of the drawing.

    Args:
        number: of the page, from 1, row by row from the upper left.
        cell: column from the left and row from the bottom.
        low: (2,) lower left corner of its window in the drawing [mm].
        high: (2,) upper right corner [mm].
    """

    number: int
    cell: Cell
    low: Array
    high: Array


@dataclass(frozen=True)
class Mark:
    """A registration mark on the cut edge of a page and at the same place on the page below it.

    Args:
        name: a letter, the same on both.
        at: (2,) its centre in the drawing [mm].
        pages: numbers of the page that is cut and of the one that it is laid over.
    """

    name: str
    at: Array
    pages: tuple[int, int]


@dataclass(frozen=True)
class PageLayout:
    """A drawing on its pages.

    Args:
        paper: as it lies.
        turn_deg: by which the drawing is turned, counter-clockwise [deg].
        drawing: turned, x to the right and y up [mm].
        tiles: in the order of their numbers.
    """

    paper: Paper
    turn_deg: float
    drawing: Drawing
    tiles: tuple[Tile, ...]

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Return the registration marks of all pages, two on each shared edge."""
        by_cell = {tile.cell: tile for tile in self.tiles}
        samples = self.drawing.samples()
        found: list[tuple[Array, tuple[int, int]]] = []
        for tile in self.tiles:
            column, row = tile.cell
            for axis, beyond in enumerate([(column + 1, row), (column, row + 1)]):
                other = by_cell.get(beyond)
                if other is not None:
                    pages = (tile.number, other.number)
                    found += [(at, pages) for at in _clear_intervals(tile, axis, samples)]
        return tuple(Mark(_letters(i), at, pages) for i, (at, pages) in enumerate(found))


@dataclass(frozen=True)
class _Grid:
    """One way to lay pages: where the window of cell (0, 0) lies, how large a window is."""

    low: Array
    window: Array
    cells: tuple[Cell, ...]


def lay_out(strip: Strip, paper: Paper, mirror: bool = False) -> PageLayout:
    """Return the layout with the fewest pages, of these the one that is turned least.

    On a roll, the one that needs the shortest piece of it.

    Args:
        strip: to draw.
        paper: to draw on, either way round.
        mirror: whether the drawing is for the strip's other side.
    """
    promising = _in_order_of_promise(strip, paper, mirror)
    best = _laid(strip, paper, mirror, *promising[0][1:])
    for bound, turn, way in promising[1:]:
        if best[0] <= bound:
            break
        best = min(best, _laid(strip, paper, mirror, turn, way), key=lambda option: option[0])
    return best[1]


def _laid(
    strip: Strip, paper: Paper, mirror: bool, turn: int, way: Paper
) -> tuple[_Rank, PageLayout]:
    """Return a layout with its rank."""
    drawing = draw_strip(strip, Placement(np.radians(turn), mirror))
    page, grid = _fewest(drawing.samples(), way)
    return _rank(page, grid, paper, turn), PageLayout(page, float(turn), drawing, _numbered(grid))


def _in_order_of_promise(
    strip: Strip, paper: Paper, mirror: bool
) -> list[tuple[_Rank, int, Paper]]:
    """Return all turns and both ways round with the rank that they have without any labels."""
    upright = draw_lines(strip, Placement(0.0, mirror)).samples()
    upright = upright[np.unique(np.round(upright / _COARSE_MM), axis=0, return_index=True)[1]]
    found = []
    for turn in _TURNS_DEG:
        samples = Placement(np.radians(turn)).points(upright)
        for way in (paper, paper.turned):
            if way is not None and way.large_enough:
                page, grid = _fewest(samples, way)
                found.append((_rank(page, grid, paper, turn), turn, way))
    return sorted(found, key=lambda option: option[0])


def _rank(page: Paper, grid: _Grid, paper: Paper, turn: int) -> _Rank:
    """Return pages, length of roll and how far it is turned; the least is the best."""
    spent = page.height or 0.0 if paper.height is None else 0.0
    return len(grid.cells), spent, abs(turn), turn, page.width


def _fewest(samples: Array, paper: Paper) -> tuple[Paper, _Grid]:
    low, high = samples.min(axis=0) - BORDER_MM, samples.max(axis=0) + BORDER_MM
    page = paper if paper.height is not None else paper.cut(float(high[1] - low[1]))
    window = np.array([page.window_width, page.window_height or 0.0])
    pitch = window - OVERLAP_MM
    counts = np.maximum(1, np.ceil((high - low - OVERLAP_MM) / pitch - 1e-9)).astype(int)
    alignments = _ALIGNMENTS if counts.prod() > 1 else _ALIGNMENTS[:1]
    spare = counts * pitch + OVERLAP_MM - (high - low)
    grids = [
        _needed(samples, _Grid(low - share * spare, window, _cells(counts)))
        for share in np.array(list(product(alignments, repeat=2)))
    ]
    return page, min(grids, key=lambda grid: len(grid.cells))


def _cells(counts: NDArray[np.int_]) -> tuple[Cell, ...]:
    """Return all cells in reading order: from the upper left, row by row."""
    columns, rows = counts.tolist()
    return tuple((column, row) for row in reversed(range(rows)) for column in range(columns))


def _needed(samples: Array, grid: _Grid) -> _Grid:
    """Return the grid without pages on which there is nothing that no neighbour shows as well."""
    cells = np.array(grid.cells)
    low = grid.low + cells * (grid.window - OVERLAP_MM)
    from_low = samples[:, None] - low
    on = np.all((from_low >= 0) & (from_low <= grid.window), axis=-1)  # (samples, pages)
    kept = on.any(axis=0)  # what is drawn is connected, and nearly always so do its pages
    if not _joined(_cells_of(grid, kept)):
        kept[:] = True
    for k in np.argsort(on.sum(axis=0), kind="stable"):
        rest = kept.copy()
        rest[k] = False
        if kept[k] and on[:, rest].any(axis=1).all() and _joined(_cells_of(grid, rest)):
            kept = rest
    return replace(grid, cells=_cells_of(grid, kept))


def _cells_of(grid: _Grid, kept: NDArray[np.bool_]) -> tuple[Cell, ...]:
    return tuple(grid.cells[i] for i in np.flatnonzero(kept))


def _window(grid: _Grid, cell: Cell) -> tuple[Array, Array]:
    low = grid.low + np.array(cell) * (grid.window - OVERLAP_MM)
    return low, low + grid.window


def _joined(cells: Sequence[Cell]) -> bool:
    """Return whether pages can be glued to one sheet, each along an edge of another."""
    remaining, new = set(cells[1:]), list(cells[:1])
    while new:
        new = [cell for known in new for cell in _beside(known) if cell in remaining]
        remaining.difference_update(new)
    return not remaining


def _beside(cell: Cell) -> Iterator[Cell]:
    column, row = cell
    yield from ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1))


def _numbered(grid: _Grid) -> tuple[Tile, ...]:
    return tuple(
        Tile(number, cell, *_window(grid, cell)) for number, cell in enumerate(grid.cells, start=1)
    )


def _clear_intervals(tile: Tile, axis: int, samples: Array) -> list[Array]:
    """Return two places on the upper or right edge of a page, away from the drawing."""
    intervals = []
    for shares in _MARKS_AT:
        at = tile.low + np.array(shares)[:, None] * (tile.high - tile.low)
        at[:, axis] = tile.high[axis]
        away = np.linalg.norm(samples[:, None] - at, axis=-1).min(axis=0)
        intervals.append(at[int(np.argmax(np.minimum(away, _MARK_CLEAR_MM)))])
    return intervals


def _letters(index: int) -> str:
    """Return a, b, ... z, aa, ab, ..."""
    letters = ""
    index += 1
    while index:
        index, rest = divmod(index - 1, 26)
        letters = chr(ord("a") + rest) + letters
    return letters
