"""Print the marker board: its sheets at 1:1, and a page that says how to use it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from reportlab.lib.colors import Color, black, white
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from workbench.errors import InputError
from workbench.photo.board import FOOT_TURN_RAD, Board
from workbench.photo.opencv import opencv

__all__ = ["CHECK_BAR_MM", "write_board"]

CHECK_BAR_MM = 200.0
"""Length of the check bar below the pattern of every sheet; upright, the pattern's own height."""

_POINTS_PER_M = 1000 * mm
_FIELD = Color(0.13, 0.13, 0.13)  # bare aluminium must stand out, a printer must not drown
_FAINT = Color(0.55, 0.55, 0.55)
_CELLS = 6  # of a marker, its black rim included
_BAR_BELOW_M = 0.0032
_FOOT_LINE_M = (0.05, 0.04, 0.15)  # x and y of its start from the field's corner, length
_SMALL_POINTS = 6.5
_LINE_POINTS = 11
_TEXT_POINTS = 11


def write_board(path: Path, board: Board) -> None:
    """Write the board as a PDF at 1:1; the same board gives the same bytes.

    Args:
        path: the `.pdf` file; one that is there is replaced.
        board: to print.

    Raises:
        InputError: when the file cannot be written or the extra `photo` is not installed.
    """
    width, height = (side * _POINTS_PER_M for side in board.sheet_size)
    canvas = Canvas(str(path), pagesize=(width, height), invariant=True)
    canvas.setTitle(f"Marker board {board.paper}")
    canvas.setViewerPreference("PrintScaling", "None")
    for sheet in reversed(range(board.sheets)):
        _draw_sheet(canvas, board, sheet)
        canvas.showPage()
    _draw_instructions(canvas, board, height)
    canvas.showPage()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        canvas.save()
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def _draw_sheet(canvas: Canvas, board: Board, sheet: int) -> None:
    """Draw one sheet; board coordinates in metres throughout, the pattern centred on the paper."""
    pattern = board.square * board.rows_a_sheet
    margin = (np.array(board.sheet_size) - [board.size[0], pattern]) / 2
    canvas.saveState()
    canvas.translate(*(margin * _POINTS_PER_M))
    canvas.saveState()
    canvas.translate(0, -sheet * pattern * _POINTS_PER_M)
    canvas.clipPath(_rectangle(canvas, [0, sheet * pattern], [board.size[0], pattern]), stroke=0)
    _draw_pattern(canvas, board)
    canvas.restoreState()
    _draw_bar(canvas, board, pattern)
    _draw_words(canvas, board, sheet, pattern)
    canvas.restoreState()


def _draw_pattern(canvas: Canvas, board: Board) -> None:
    low, high = board.field
    _fill(canvas, low, high - low, _FIELD)
    square = np.full(2, board.square)
    for place in board.squares:
        if place.sum() % 2 == 0:
            _fill(canvas, board.square * place, square, black)
    for number, corners in enumerate(board.marker_corners()):
        _draw_marker(canvas, board, board.first_marker + number, corners[3])
    start = low + np.array(_FOOT_LINE_M[:2])
    way = np.array([np.cos(FOOT_TURN_RAD), np.sin(FOOT_TURN_RAD)])
    end = start + _FOOT_LINE_M[2] * way
    canvas.setStrokeColor(_FAINT)
    canvas.setLineWidth(0.4 * mm)
    barb = 0.006 * np.array([[-way[0] - way[1], way[0] - way[1]], [way[1] - way[0], -way.sum()]])
    for one, other in ((start, end), (end, end + barb[0]), (end, end + barb[1])):
        canvas.line(*(np.concatenate([one, other]) * _POINTS_PER_M))
    canvas.saveState()
    canvas.translate(*(start * _POINTS_PER_M))
    canvas.rotate(float(np.degrees(FOOT_TURN_RAD)))
    canvas.setFillColor(_FAINT)
    canvas.setFont("Helvetica", _LINE_POINTS)
    canvas.drawString(0, 1.2 * mm, "foot line: the robot hops this way")
    canvas.restoreState()


def _draw_marker(canvas: Canvas, board: Board, number: int, corner: NDArray[np.float64]) -> None:
    """Draw a marker from its lower left corner."""
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
    cells = cv2.aruco.generateImageMarker(dictionary, number, _CELLS)[::-1]
    cell = board.marker / _CELLS
    _fill(canvas, corner, np.full(2, board.marker), black)
    for row, column in np.argwhere(cells > 0):
        _fill(canvas, corner + cell * np.array([column, row]), np.full(2, cell), white)


def _draw_bar(canvas: Canvas, board: Board, pattern: float) -> None:
    """Draw the check bar H below the pattern and V's ends at its left corners."""
    bar, below = CHECK_BAR_MM * mm, -_BAR_BELOW_M * _POINTS_PER_M
    canvas.setStrokeColor(black)
    canvas.setFillColor(black)
    canvas.setLineWidth(0.2 * mm)
    canvas.line(0, below, bar, below)
    for end in (0.0, bar):
        canvas.line(end, below - mm, end, below + mm)
    canvas.setFont("Helvetica", _SMALL_POINTS)
    canvas.drawString(
        bar + 2 * mm, below - 0.8 * mm, f"H, measure this: must be {CHECK_BAR_MM:.1f} mm"
    )


def _draw_words(canvas: Canvas, board: Board, sheet: int, pattern: float) -> None:
    above = pattern * _POINTS_PER_M + 2 * mm
    canvas.setFont("Helvetica", _SMALL_POINTS)
    canvas.drawString(
        0,
        above,
        f"Marker board {board.paper}, sheet {board.sheets - sheet} of {board.sheets} from the top. "
        f"V, measure the pattern's height at the left edge: must be {1000 * pattern:.1f} mm",
    )
    if board.sheets > 1:
        edge = "bottom" if sheet else "top"
        canvas.drawRightString(
            board.size[0] * _POINTS_PER_M, above, f"cut along the pattern's {edge} edge and butt"
        )


def _draw_instructions(canvas: Canvas, board: Board, height: float) -> None:
    text = canvas.beginText(20 * mm, height - 25 * mm)
    text.setFont("Helvetica-Bold", 15)
    text.textLine("How to read a bent strip back")
    text.setFont("Helvetica", _TEXT_POINTS)
    text.setLeading(1.5 * _TEXT_POINTS)
    for line in _instructions(board):
        text.textLine(line)
    canvas.drawText(text)


def _instructions(board: Board) -> list[str]:
    joined = (
        [
            "   Cut both sheets along the edge named on them and butt them on a plate; the reading",
            "   measures how they were joined.",
        ]
        if board.sheets > 1
        else []
    )
    height = 1000 * board.square * board.rows_a_sheet
    return [
        "",
        "1. Print at 100 %, without fitting to the page, on dull paper. Tape it flat to a plate.",
        *joined,
        f"2. Measure bar H ({CHECK_BAR_MM:.1f} mm) and the pattern's height V ({height:.1f} mm)",
        "   to 0.2 mm and give both to `workbench template read` as --h and --v if they are off.",
        "3. Lay the strip on its edge, all of it on the dark field, nothing on the border. Any",
        "   place and turn will do. For the angle at the foot too, lay the foot along the foot",
        "   line, the robot's forward the way of the arrow, and say --foot-aligned.",
        "4. Light from above, evenly, no lamp mirrored in the strip. On a strip that does not",
        "   stand out, put coloured tape on the upper edge and say --tape blue.",
        "5. Photograph from straight above, at least 0.8 m away (zoom in rather than come close),",
        "   the whole board sharp and filling the picture. No wide angle, panorama or cropping.",
        "6. workbench template read PHOTO.jpg --shape TARGET.yaml --out as-bent.yaml",
    ]


def _fill(
    canvas: Canvas, corner: NDArray[np.float64], size: NDArray[np.float64], color: Color
) -> None:
    canvas.setFillColor(color)
    x, y, width, height = np.concatenate([corner, size]) * _POINTS_PER_M
    canvas.rect(x, y, width, height, stroke=0, fill=1)


def _rectangle(canvas: Canvas, corner: list[float], size: list[float]) -> PDFPathObject:
    path = canvas.beginPath()
    x, y, width, height = np.array([*corner, *size]) * _POINTS_PER_M
    path.rect(x, y, width, height)
    return path
