"""A PDF that prints at 1:1, drawn in millimetres: pages, pens, texts and check bars."""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path
from typing import NamedTuple

import reportlab
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas

from workbench.template.figure import Anchor
from workbench.template.paper import BAR_MM, BAR_STRIP_MM, MARGIN_MM, Paper

__all__ = [
    "BLACK",
    "FRAME",
    "NO_COMPENSATION",
    "Compensation",
    "Pen",
    "begin_page",
    "draw_check_bars",
    "new_canvas",
    "set_pen",
    "write_text",
]

FONT, BOLD = "Vera", "VeraBd"  # come with reportlab; embedded, so that every printer has them
_THEN = (
    "print at 100 %, never fitted to the page; then",
    "workbench template confirm FILE --h .. --v ..",
)
_TICK_MM = 2.0  # half of a check bar's end tick
_MINOR_MM = 10.0  # between a check bar's minor ticks


class Compensation(NamedTuple):
    """What a drawing is stretched by before it is printed, against what the printer does to it.

    Args:
        h: along the page's horizontal.
        v: along its vertical.
    """

    h: float = 1.0
    v: float = 1.0


NO_COMPENSATION = Compensation()


class Pen(NamedTuple):
    """How a line is drawn.

    Args:
        width: [mm].
        colour: red, green and blue from 0 to 1.
        dashes: lengths drawn and left out in turn [mm]; empty is solid.
    """

    width: float
    colour: tuple[float, float, float] = (0.0, 0.0, 0.0)
    dashes: tuple[float, ...] = ()


BLACK = Pen(0.2)
_BAR = Pen(0.25)
FRAME = Pen(0.12, (0.45, 0.45, 0.45))


def new_canvas(title: str) -> tuple[Canvas, io.BytesIO]:
    """Return an empty PDF, the same bytes for the same drawing, and where it is written.

    Its viewer preferences ask for no scaling; browsers may ignore that, hence the check bars.
    """
    _load_fonts()
    stream = io.BytesIO()
    canvas = Canvas(stream, invariant=1, pageCompression=1)
    canvas.setTitle(title)
    canvas.setCreator("hopping workbench")
    canvas.setViewerPreference("PrintScaling", "None")
    return canvas, stream


def begin_page(canvas: Canvas, paper: Paper, compensation: Compensation = NO_COMPENSATION) -> None:
    """Begin a page: from here to `showPage` all lengths are millimetres from its lower left.

    Args:
        canvas: on which no page is open.
        paper: cut to length.
        compensation: stretches everything about the page's middle.
    """
    width, height = paper.width, paper.height or 0.0
    canvas.setPageSize((width * mm, height * mm))
    canvas.scale(mm, mm)
    canvas.translate(width / 2, height / 2)
    canvas.scale(compensation.h, compensation.v)
    canvas.translate(-width / 2, -height / 2)
    canvas.setLineCap(0)


def set_pen(canvas: Canvas, pen: Pen) -> None:
    """Draw and fill with a pen from here on."""
    canvas.setLineWidth(pen.width)
    canvas.setStrokeColorRGB(*pen.colour)
    canvas.setFillColorRGB(*pen.colour)
    canvas.setDash(list(pen.dashes))


def write_text(
    canvas: Canvas,
    x: float,
    y: float,
    text: str,
    height: float = 2.4,
    *,
    anchor: Anchor = "start",
    bold: bool = False,
    turned: bool = False,
    room: float | None = None,
) -> None:
    """Write one line.

    Args:
        canvas: with an open page.
        x: where the baseline begins, has its middle or ends [mm].
        y: of the baseline [mm].
        text: to write.
        height: of the font [mm].
        anchor: what x is.
        bold: whether in bold.
        turned: whether it reads upwards.
        room: the width to keep to [mm]; a longer text is written smaller.
    """
    font = BOLD if bold else FONT
    width = pdfmetrics.stringWidth(text, font, height)
    if room is not None and width > room:
        height *= room / width
    canvas.saveState()
    canvas.translate(x, y)
    if turned:
        canvas.rotate(90)
    canvas.setFont(font, height)
    shift = {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
    canvas.drawString(-shift * pdfmetrics.stringWidth(text, font, height), 0, text)
    canvas.restoreState()


def draw_check_bars(canvas: Canvas, paper: Paper) -> None:
    """Draw a bar along each axis of the page, with the words to measure it and what to do then."""
    words = f"measure this bar: it must be {BAR_MM:g} mm"
    left, up = paper.corner
    x, y, cell = _cell_of(paper)
    set_pen(canvas, _BAR)
    _bar(canvas, x, y)
    write_text(canvas, x, y + 3.2, f"H: {words}", bold=True)
    for k, text in enumerate(_THEN):
        write_text(canvas, cell[0], cell[1] - 3.4 * k, text)
    canvas.saveState()
    canvas.translate(left - 4.0, up + 4.0)
    canvas.rotate(90)
    _bar(canvas, 0.0, 0.0)
    canvas.restoreState()
    write_text(canvas, left - 7.2, up + 4.0, f"V: {words}", bold=True, turned=True)


def _cell_of(paper: Paper) -> tuple[float, float, tuple[float, float]]:
    """Return where the horizontal bar begins, and where the words beside or below it do [mm]."""
    if paper.wide:
        x, y = paper.width - MARGIN_MM - BAR_MM - 1.0, MARGIN_MM + 13.0
        return x, y, (x, y - 6.0)
    x, y = MARGIN_MM + BAR_STRIP_MM, MARGIN_MM + paper.title_height - 8.0
    return x, y, (x + BAR_MM + 3.0, y + 0.6)


def _bar(canvas: Canvas, x: float, y: float) -> None:
    canvas.line(x, y, x + BAR_MM, y)
    for end in (x, x + BAR_MM):
        canvas.line(end, y - _TICK_MM, end, y + _TICK_MM)
    for k in range(1, int(BAR_MM / _MINOR_MM)):
        canvas.line(x + k * _MINOR_MM, y - _TICK_MM / 2, x + k * _MINOR_MM, y)


@cache
def _load_fonts() -> None:
    folder = Path(reportlab.__file__).parent / "fonts"
    for font in (FONT, BOLD):
        pdfmetrics.registerFont(TTFont(font, str(folder / f"{font}.ttf")))
