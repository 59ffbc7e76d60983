"""Write the pages as PDF at 1:1: on each its part of the drawing, registration marks and block."""

from __future__ import annotations

import numpy as np
from reportlab.pdfgen.canvas import Canvas

from workbench.template.block import draw_block
from workbench.template.canvas import (
    BLACK,
    FRAME,
    Pen,
    begin_page,
    draw_check_bars,
    new_canvas,
    set_pen,
    write_text,
)
from workbench.template.figure import Label, Layer, Path, arc
from workbench.template.overbend import draw_overbend
from workbench.template.paper import OVERLAP_MM
from workbench.template.sheet import TemplatePages
from workbench.template.tiles import Mark, Tile

__all__ = ["PENS", "pdf_pages"]

PENS: dict[Layer, Pen] = {
    Layer.CONTOUR: Pen(0.25),
    Layer.CENTRELINE: Pen(0.13, (0.75, 0.0, 0.0), (6.0, 1.0, 1.0, 1.0)),
    Layer.POLYLINE: Pen(0.13, (0.4, 0.4, 0.4), (2.0, 1.2)),
    Layer.STATIONS: Pen(0.18, (0.0, 0.25, 0.7)),
    Layer.FOOT: Pen(0.25, (0.2, 0.2, 0.2)),
    Layer.TIP: Pen(0.2, (0.75, 0.0, 0.0)),
}
"""How each layer is drawn; thin lines leave a sharp edge to lay the strip against."""

_CUT = Pen(0.18, (0.0, 0.0, 0.0), (3.0, 1.5))
_BENEATH = Pen(0.12, (0.45, 0.45, 0.45), (0.6, 1.2))
_MARK_MM, _CROSS_MM = 2.5, 4.5  # radius of a registration mark, reach of its cross


def pdf_pages(sheet: TemplatePages) -> bytes:
    """Return the PDF, the same bytes for the same sheet."""
    strip = sheet.strip
    canvas, stream = new_canvas(f"{strip.name} {strip.short_hash}")
    for tile in sheet.layout.tiles:
        begin_page(canvas, sheet.layout.paper, sheet.compensation)
        _draw_part(canvas, sheet, tile)
        _draw_edges(canvas, sheet, tile)
        draw_check_bars(canvas, sheet.layout.paper)
        draw_block(canvas, sheet, tile.number)
        canvas.showPage()
    if sheet.metal is not None:
        begin_page(canvas, sheet.layout.paper, sheet.compensation)
        draw_overbend(canvas, sheet, sheet.metal)
        draw_check_bars(canvas, sheet.layout.paper)
        draw_block(canvas, sheet, sheet.pages)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def _to_window(canvas: Canvas, sheet: TemplatePages, tile: Tile) -> None:
    """Move the origin to the drawing's as it lies on this page."""
    x, y = np.array(sheet.layout.paper.corner) - tile.low
    canvas.translate(float(x), float(y))


def _draw_part(canvas: Canvas, sheet: TemplatePages, tile: Tile) -> None:
    """Draw what lies in a page's window."""
    canvas.saveState()
    _to_window(canvas, sheet, tile)
    width, height = (tile.high - tile.low).tolist()
    window = canvas.beginPath()
    window.rect(float(tile.low[0]), float(tile.low[1]), width, height)
    canvas.clipPath(window, stroke=0)
    for path in sheet.layout.drawing.paths:
        _draw_path(canvas, path)
    for label in sheet.layout.drawing.labels:
        _draw_label(canvas, label)
    canvas.restoreState()


def _draw_path(canvas: Canvas, path: Path) -> None:
    set_pen(canvas, PENS[path.layer])
    course = canvas.beginPath()
    course.moveTo(*path.points[0].tolist())
    for start, end, bulge in path.pieces:
        found = arc(start, end, bulge)
        if found is None:
            course.lineTo(*end.tolist())
            continue
        low, high = found.centre - found.radius, found.centre + found.radius
        begin, sweep = np.degrees([found.begin, found.sweep]).tolist()
        course.arcTo(*low.tolist(), *high.tolist(), startAng=begin, extent=sweep)
    if path.closed:
        course.close()
    canvas.drawPath(course)


def _draw_label(canvas: Canvas, label: Label) -> None:
    set_pen(canvas, PENS[label.layer])
    x, y = label.at.tolist()
    write_text(canvas, x, y, label.text, label.height, anchor=label.anchor)


def _draw_edges(canvas: Canvas, sheet: TemplatePages, tile: Tile) -> None:
    """Draw the window, where to cut, where the neighbours' edges come, and the marks."""
    canvas.saveState()
    _to_window(canvas, sheet, tile)
    set_pen(canvas, FRAME)
    size = (tile.high - tile.low).tolist()
    canvas.rect(*tile.low.tolist(), *size)
    numbers = {other.cell: other.number for other in sheet.layout.tiles}
    column, row = tile.cell
    for axis in (0, 1):
        step = (1, 0) if axis == 0 else (0, 1)
        beyond = numbers.get((column + step[0], row + step[1]))
        before = numbers.get((column - step[0], row - step[1]))
        if beyond is not None:
            _edge(canvas, tile, axis, float(tile.high[axis]), _CUT)
            _label_edge(canvas, tile, axis, f"cut here, lay over page {beyond}")
        if before is not None:
            at = float(tile.low[axis]) + OVERLAP_MM
            _edge(canvas, tile, axis, at, _BENEATH)
            _label_neighbour(canvas, tile, axis, at, f"page {before} comes to here")
    for mark in sheet.layout.marks:
        if tile.number in mark.pages:
            _draw_mark(canvas, mark)
    canvas.restoreState()


def _edge(canvas: Canvas, tile: Tile, axis: int, at: float, pen: Pen) -> None:
    """Draw a line across the window, at right angles to an axis."""
    set_pen(canvas, pen)
    ends = np.array([tile.low, tile.high])
    ends[:, axis] = at
    canvas.line(*ends[0].tolist(), *ends[1].tolist())


def _label_edge(canvas: Canvas, tile: Tile, axis: int, words: str) -> None:
    """Write along the upper or the right edge of the window, outside of it."""
    set_pen(canvas, BLACK)
    x, y = ((tile.low + tile.high) / 2).tolist()
    if axis == 0:
        write_text(canvas, float(tile.high[0]) + 3.2, y, words, anchor="middle", turned=True)
    else:
        write_text(canvas, x, float(tile.high[1]) + 1.2, words, anchor="middle")


def _label_neighbour(canvas: Canvas, tile: Tile, axis: int, at: float, words: str) -> None:
    """Write along the line to which a neighbour covers the window."""
    x, y = ((tile.low + tile.high) / 2).tolist()
    if axis == 0:
        write_text(canvas, at - 0.8, y, words, 2.0, anchor="middle", turned=True)
    else:
        write_text(canvas, x, at + 0.8, words, 2.0, anchor="middle")


def _draw_mark(canvas: Canvas, mark: Mark) -> None:
    set_pen(canvas, BLACK)
    x, y = mark.at.tolist()
    canvas.circle(x, y, _MARK_MM)
    canvas.line(x - _CROSS_MM, y, x + _CROSS_MM, y)
    canvas.line(x, y - _CROSS_MM, x, y + _CROSS_MM)
    write_text(canvas, x - _MARK_MM - 0.6, y - _MARK_MM - 1.6, mark.name, bold=True, anchor="end")
