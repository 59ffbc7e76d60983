"""The strip at the bottom of a page: QR code, title block, page map."""

from __future__ import annotations

import numpy as np
import segno
from reportlab.pdfgen.canvas import Canvas

from workbench.shape import bend_radii
from workbench.template.canvas import BLACK, FRAME, NO_COMPENSATION, Pen, set_pen, write_text
from workbench.template.figure import Layer
from workbench.template.paper import BAR_MM, MARGIN_MM
from workbench.template.sheet import TemplatePages
from workbench.template.strip import Strip

__all__ = ["draw_block", "qr_text"]

_QR_MM = 25.0  # with its quiet zone
_QUIET = 4  # modules around a QR code
_MAP_MM = (30.0, 25.0)  # width and height of the page map
_GAP_MM = 3.0
_LINE_MM = 3.0
_WIDEST_MM = 200.0
_TITLE_SIZE_MM, _TEXT_SIZE_MM = 3.6, 2.2
_FILLED = Pen(0.12, (0.82, 0.82, 0.82))


def qr_text(sheet: TemplatePages) -> str:
    """Return what the QR code says: the shape and the hash of its file."""
    return f"{sheet.strip.name} {sheet.strip.short_hash}"


def draw_block(canvas: Canvas, sheet: TemplatePages, number: int) -> None:
    """Draw QR code, title block and page map of a page, which has a number from 1."""
    _draw_qr(canvas, qr_text(sheet), MARGIN_MM, MARGIN_MM)
    paper = sheet.layout.paper
    room = paper.width - 2 * MARGIN_MM - (BAR_MM + 2 * _GAP_MM if paper.wide else 0.0)
    room = min(room, _WIDEST_MM)
    left = MARGIN_MM + _QR_MM + _GAP_MM
    words = room - _QR_MM - _MAP_MM[0] - 2 * _GAP_MM
    _write_title(canvas, sheet, number, left, words)
    _draw_map(canvas, sheet, number, left + words + _GAP_MM, MARGIN_MM)


def _draw_qr(canvas: Canvas, text: str, x: float, y: float) -> None:
    set_pen(canvas, BLACK)
    modules = np.array([list(row) for row in segno.make(text, error="m", micro=False).matrix])
    size = _QR_MM / (len(modules) + 2 * _QUIET)
    top = y + _QR_MM - _QUIET * size
    for k, row in enumerate(modules):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], row > 0, [0]]).astype(int)))
        for begin, end in edges.reshape(-1, 2).tolist():  # each run of dark modules
            left, width = x + (_QUIET + begin) * size, (end - begin) * size
            canvas.rect(left, top - (k + 1) * size, width, size, stroke=0, fill=1)


def _write_title(canvas: Canvas, sheet: TemplatePages, number: int, x: float, room: float) -> None:
    set_pen(canvas, BLACK)
    y = MARGIN_MM + _QR_MM - _TITLE_SIZE_MM
    page = f"page {number} of {sheet.pages}"
    write_text(canvas, x, y, sheet.strip.name, _TITLE_SIZE_MM, bold=True, room=room - 30.0)
    write_text(canvas, x + room, y, page, _TITLE_SIZE_MM, bold=True, anchor="end")
    for text in _lines(sheet):
        y -= _LINE_MM
        write_text(canvas, x, y, text, _TEXT_SIZE_MM, room=room)


def _lines(sheet: TemplatePages) -> list[str]:
    """Return what the title block says below the name."""
    strip, layout = sheet.strip, sheet.layout
    radius = float(bend_radii(strip.angles, strip.length).min())
    side = "MIRRORED: seen from the robot's left" if sheet.mirror else "seen from the robot's right"
    turned = f", turned by {layout.turn_deg:g}° to save paper" if layout.turn_deg else ""
    return [
        f"shape {strip.short_hash}  |  {sheet.day.isoformat()}  |  {layout.paper.name}  |  "
        f"strip {1000 * strip.thickness:g} mm thick, {1000 * strip.length:.2f} mm long",
        f"RELEASED SHAPE, check unloaded: {_state(strip)}",
        f"{side}{turned}",
        "solid: equal-length arcs, bend k spread half an increment to either side",
        "of station k, length and mid-increment tangents kept; dashed: the model's polyline",
        f"tightest bend R {1000 * radius:.0f} mm, {radius / strip.thickness:.0f} times the "
        "thickness; neutral axis in the middle, no bend allowance",
        _compensation(sheet),
    ]


def _state(strip: Strip) -> str:
    if strip.model is None:
        return "the shape file lists the free strip"
    return f"the file lists the standing robot (loaded), freed by model {strip.model}"


def _compensation(sheet: TemplatePages) -> str:
    if sheet.compensation == NO_COMPENSATION:
        return "print compensation: none"
    return (
        f"COMPENSATED: H x {sheet.compensation.h:.5f}, V x {sheet.compensation.v:.5f}, "
        "for one printer only"
    )


def _draw_map(canvas: Canvas, sheet: TemplatePages, number: int, x: float, y: float) -> None:
    """Draw all pages small, this one filled, with the strip across them."""
    tiles = sheet.layout.tiles
    low = np.min([t.low for t in tiles], axis=0)
    span = np.max([t.high for t in tiles], axis=0) - low
    scale = float(np.min(np.array(_MAP_MM) / span))
    canvas.saveState()
    canvas.translate(x, y)
    for other in sorted(tiles, key=lambda other: other.number == number):
        set_pen(canvas, _FILLED)
        box = (scale * np.concatenate([other.low - low, other.high - other.low])).tolist()
        if other.number == number:
            canvas.rect(*box, stroke=0, fill=1)
        set_pen(canvas, FRAME)
        canvas.rect(*box)
    _draw_strip_small(canvas, sheet, low, scale)
    set_pen(canvas, BLACK)
    for other in tiles:
        at = scale * (other.low - low) + 0.8  # the lower left corner is no neighbour's
        write_text(canvas, float(at[0]), float(at[1]), str(other.number), bold=True)
    canvas.restoreState()


def _draw_strip_small(canvas: Canvas, sheet: TemplatePages, low: np.ndarray, scale: float) -> None:
    set_pen(canvas, Pen(0.3, (0.75, 0.0, 0.0)))
    course = canvas.beginPath()
    (path,) = sheet.layout.drawing.layer(Layer.CENTRELINE)
    points = (scale * (path.points - low)).tolist()
    course.moveTo(*points[0])
    for point in points[1:]:
        course.lineTo(*point)
    canvas.drawPath(course)
