"""Spread a drawing over the fewest pages: how it is turned, where the pages lie, what they share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from workbench.template.drawing import Placement, draw_strip
from workbench.template.figure import Drawing
from workbench.template.paper import OVERLAP_MM, Paper
from workbench.template.strip import Strip

__all__ = ["Layout", "Mark", "Tile", "lay_out"]

Array = NDArray[np.float64]
Cell = tuple[int, int]
"""Column from the left and row from the bottom."""

_TURNS_DEG = tuple(range(0, 180, 5))
_ALIGNMENTS = (0.5, 0.0, 1.0)  # where the drawing lies in what room the pages have to spare
_MARKS_AT = (0.2, 0.8)  # of a shared edge's length
_BORDER_MM = 2.0  # between the drawing and the edge of its pages


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
class Layout:
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
        """Return the registration marks of all pages."""
        by_cell = {tile.cell: tile for tile in self.tiles}
        found: list[tuple[Array, tuple[int, int]]] = []
        for tile in self.tiles:
            column, row = tile.cell
            for axis, beyond in enumerate([(column + 1, row), (column, row + 1)]):
                other = by_cell.get(beyond)
                if other is None:
                    continue
                for share in _MARKS_AT:
                    at = tile.low + share * (tile.high - tile.low)
                    at[axis] = tile.high[axis]
                    found.append((at, (tile.number, other.number)))
        return tuple(Mark(_letters(i), at, pages) for i, (at, pages) in enumerate(found))


@dataclass(frozen=True)
class _Grid:
    """One way to lay pages: where the window of cell (0, 0) lies, how large a window is."""

    low: Array
    window: Array
    cells: tuple[Cell, ...]


def lay_out(strip: Strip, paper: Paper, mirror: bool = False) -> Layout:
    """Return the layout with the fewest pages, of these the one that is turned least.

    On a roll, the one that needs the shortest piece of it.

    Args:
        strip: to draw.
        paper: to draw on, either way round.
        mirror: whether the drawing is for the strip's other side.
    """
    ways = [way for way in (paper, paper.turned) if way is not None and way.large_enough]
    best: tuple[tuple[float, ...], Layout] | None = None
    for turn in _TURNS_DEG:
        drawing = draw_strip(strip, Placement(np.radians(turn), mirror))
        samples = drawing.samples()
        for k, way in enumerate(ways):
            page, grid = _fewest(samples, way)
            rank = (len(grid.cells), _spent(page, paper), min(turn, 180 - turn), turn, k)
            if best is None or rank < best[0]:
                best = rank, Layout(page, float(turn), drawing, _numbered(grid))
    assert best is not None
    return best[1]


def _spent(page: Paper, paper: Paper) -> float:
    """Return the length of a roll that is used; other pages are all the same size."""
    return page.height or 0.0 if paper.height is None else 0.0


def _fewest(samples: Array, paper: Paper) -> tuple[Paper, _Grid]:
    low, high = samples.min(axis=0) - _BORDER_MM, samples.max(axis=0) + _BORDER_MM
    page = paper if paper.height is not None else paper.cut(float(high[1] - low[1]))
    window = np.array([page.window_width, page.window_height or 0.0])
    pitch = window - OVERLAP_MM
    counts = np.maximum(1, np.ceil((high - low - OVERLAP_MM) / pitch - 1e-9)).astype(int)
    spare = counts * pitch + OVERLAP_MM - (high - low)
    grids = [
        _needed(samples, _Grid(low - share * spare, window, _cells(counts)))
        for share in np.array(list(product(_ALIGNMENTS, repeat=2)))
    ]
    return page, min(grids, key=lambda grid: len(grid.cells))


def _cells(counts: NDArray[np.int_]) -> tuple[Cell, ...]:
    """Return all cells in reading order: from the upper left, row by row."""
    columns, rows = counts.tolist()
    return tuple((column, row) for row in reversed(range(rows)) for column in range(columns))


def _needed(samples: Array, grid: _Grid) -> _Grid:
    """Return the grid without pages on which there is nothing that no neighbour shows as well."""
    on = {cell: _on(samples, grid, cell) for cell in grid.cells}
    kept = list(grid.cells)
    for cell in sorted(grid.cells, key=lambda cell: int(on[cell].sum())):
        others = [other for other in kept if other != cell]
        if not others or not _joined(others):
            continue
        if np.any(on[cell] & ~np.logical_or.reduce([on[other] for other in others])):
            continue
        kept = others
    return replace(grid, cells=tuple(kept))


def _on(samples: Array, grid: _Grid, cell: Cell) -> NDArray[np.bool_]:
    low, high = _window(grid, cell)
    return np.all((samples >= low) & (samples <= high), axis=1)


def _window(grid: _Grid, cell: Cell) -> tuple[Array, Array]:
    low = grid.low + np.array(cell) * (grid.window - OVERLAP_MM)
    return low, low + grid.window


def _joined(cells: Sequence[Cell]) -> bool:
    """Return whether pages can be glued to one sheet, each along an edge of another."""
    reached, new = {cells[0]}, [cells[0]]
    while new:
        new = [n for cell in new for n in _beside(cell) if n in cells and n not in reached]
        reached.update(new)
    return len(reached) == len(cells)


def _beside(cell: Cell) -> Iterator[Cell]:
    column, row = cell
    yield from ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1))


def _numbered(grid: _Grid) -> tuple[Tile, ...]:
    return tuple(
        Tile(number, cell, *_window(grid, cell)) for number, cell in enumerate(grid.cells, start=1)
    )


def _letters(index: int) -> str:
    """Return a, b, ... z, aa, ab, ..."""
    letters = ""
    index += 1
    while index:
        index, rest = divmod(index - 1, 26)
        letters = chr(ord("a") + rest) + letters
    return letters
