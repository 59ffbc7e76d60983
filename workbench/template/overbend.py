"""The radii to bend a strip to, so that springback leaves those of the shape; the page of them.

Held at radius R, an elastic and perfectly plastic strip in plane bending springs back to R' with

    R / R' = 1 - 3 x + 4 x^3,   x = R Y / (E t)

(the handbooks' springback equation; Y yield strength, E modulus, t thickness). At x = 1/2 only the
surface begins to yield, and nothing stays: every bend that lasts is held tighter than E t / (2 Y).
Hardening and earlier bends are not in it, so the released strip is what counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from reportlab.pdfgen.canvas import Canvas

from workbench.template.canvas import BLACK, FRAME, set_pen, write_text
from workbench.template.figure import Anchor
from workbench.template.metal import Metal
from workbench.template.sheet import TemplatePages
from workbench.template.strip import Strip

__all__ = ["OverBend", "draw_overbend", "held_radius", "overbends"]

_ELASTIC = 0.5  # x at which nothing of a bend stays
_ROW_MM, _SIZE_MM = 5.0, 2.8
_COLUMNS: tuple[tuple[str, float, Anchor], ...] = (
    ("station", 2.0, "start"),
    ("from the root [mm]", 48.0, "end"),
    ("bend [deg]", 74.0, "end"),
    ("radius [mm]", 100.0, "end"),
    ("held radius [mm]", 132.0, "end"),
    ("held bend [deg]", 162.0, "end"),
)
"""Heading, place from the left of the window [mm] and what of the text is there."""


class OverBend(NamedTuple):
    """A station's bend, released and held.

    Args:
        station: its number.
        distance: from the root along the strip [m].
        bend: released [rad].
        radius: released [m]; infinite where straight.
        held_radius: to bend to [m]; infinite where straight.
        held_bend: with the arc held at that radius [rad].
    """

    station: int
    distance: float
    bend: float
    radius: float
    held_radius: float
    held_bend: float


def held_radius(radius: float, thickness: float, metal: Metal) -> float:
    """Return the radius of the centreline to hold, so that a released one is left [m].

    Args:
        radius: that shall be left [m].
        thickness: of the strip [m].
        metal: of the strip.
    """
    if not np.isfinite(radius):
        return float("inf")
    yielding = metal.yield_strength / (metal.modulus * thickness)  # [1/m]; x = R * yielding
    wanted = 1 / (radius * yielding)
    found = scipy.optimize.root_scalar(
        lambda x: 1 - 3 * x + 4 * x**3 - wanted * x, bracket=(0.0, _ELASTIC)
    )
    return float(found.root) / yielding


def overbends(strip: Strip, metal: Metal) -> list[OverBend]:
    """Return all stations that are bent, from 1 on."""
    step = strip.length / len(strip.angles)
    found = []
    for k, bend in enumerate(strip.angles[1:], start=1):
        radius = step / abs(bend) if bend else float("inf")
        held = held_radius(radius, strip.thickness, metal)
        turned = float(np.copysign(step / held, bend))
        found.append(OverBend(k, k * step, bend, radius, held, turned))
    return found


def draw_overbend(canvas: Canvas, sheet: TemplatePages, metal: Metal) -> None:
    """Draw the table of radii into the window of an open page."""
    paper, strip = sheet.layout.paper, sheet.strip
    left, low = paper.corner
    y = low + (paper.window_height or 0.0) - 6.0
    elastic = metal.modulus * strip.thickness / (2 * metal.yield_strength)
    set_pen(canvas, BLACK)
    for text, bold in (
        ("Over-bend: hold each bend at this radius, and springback leaves the shape", True),
        (f"yield strength {metal.yield_strength / 1e6:g} MPa, modulus {metal.modulus / 1e9:g} GPa, "
         f"strip {1000 * strip.thickness:g} mm: nothing stays above a held radius of "
         f"{1000 * elastic:.0f} mm", False),
        ("elastic, perfectly plastic strip; radii of the centreline; a start for trials, the "
         "released strip on the template is what counts", False),
    ):  # fmt: skip
        write_text(canvas, left, y, text, _SIZE_MM, bold=bold, room=paper.window_width)
        y -= _ROW_MM
    _write_row(canvas, left, y, [name for name, *_ in _COLUMNS], bold=True)
    for bend in overbends(strip, metal):
        set_pen(canvas, FRAME)
        canvas.line(left, y - 1.5, left + _COLUMNS[-1][1] + 2.0, y - 1.5)
        set_pen(canvas, BLACK)
        y -= _ROW_MM
        _write_row(canvas, left, y, _cells(bend))


def _cells(bend: OverBend) -> list[str]:
    cells = [f"{bend.station}", f"{1000 * bend.distance:.1f}", f"{np.degrees(bend.bend):+.1f}"]
    if not np.isfinite(bend.radius):
        return [*cells, "straight", "", ""]
    held = [f"{1000 * bend.held_radius:.0f}", f"{np.degrees(bend.held_bend):+.1f}"]
    return [*cells, f"{1000 * bend.radius:.0f}", *held]


def _write_row(
    canvas: Canvas, left: float, y: float, cells: list[str], *, bold: bool = False
) -> None:
    size = 0.85 * _SIZE_MM if bold else _SIZE_MM
    for (_, at, anchor), text in zip(_COLUMNS, cells, strict=True):
        write_text(canvas, left + at, y, text, size, anchor=anchor, bold=bold)
