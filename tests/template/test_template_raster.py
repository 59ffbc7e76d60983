"""What comes out of the printer, measured at 300 dpi; the bar is 0.1 mm."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.template.conftest import MakeSheet
from tests.template.raster import (
    PIXEL_MM,
    Array,
    bars,
    cross_near,
    line_near,
    needs_poppler,
    pages,
    walked,
)
from workbench.template import Compensation, TemplatePages, pdf_pages

BAR_MM = 0.1
HALF_TICK_MM = 1.0 + 1.25  # half the thickness and half of what a station's tick reaches beyond
MARK_ARM_MM = 3.5  # between a registration mark's circle and the end of its cross

pytestmark = needs_poppler

SHEETS = [
    ("A4", False, None),
    ("A3", False, None),
    ("Letter", True, None),
    ("Tabloid", True, None),
    ("roll", False, 0.61),
    ("205x200mm", False, None),
]


@pytest.fixture(scope="module", params=SHEETS, ids=lambda p: f"{p[0]}{'-mirrored' if p[1] else ''}")
def printed(
    request: pytest.FixtureRequest, sheet: MakeSheet, tmp_path_factory: pytest.TempPathFactory
) -> tuple[TemplatePages, list[Array]]:
    name, mirror, roll_width = request.param
    template = sheet(name, mirror, roll_width)
    return template, pages(pdf_pages(template), tmp_path_factory.mktemp("printed"))


def expected(template: TemplatePages, parts: int = 16) -> tuple[Array, Array]:
    """Ends of equal parts and unit tangents as they lie on the drawing, from tiny steps [mm]."""
    points, heading = walked(np.array(template.strip.angles), template.strip.length, parts)
    tangents = np.stack([np.cos(heading), -np.sin(heading)], axis=1)
    flip = np.array([-1.0 if template.mirror else 1.0, 1.0])
    turn = np.radians(template.layout.turn_deg)
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return points * flip @ rotation, tangents * flip @ rotation


def test_bars_stations_and_marks_are_where_they_belong(
    printed: tuple[TemplatePages, list[Array]],
) -> None:
    template, scans = printed
    lengths = [measured for scan in scans for measured in bars(scan)]
    assert [axis for axis, _ in lengths] == ["H", "V"] * len(scans)
    worst_bar = max(abs(length - 100) for _, length in lengths)

    shifts, worst_mark = glue(template, scans)
    points, tangents = expected(template)
    found = stations(template, scans, points, tangents, shifts)
    assert sorted(found) == list(range(16))
    measured = np.array([found[k] for k in range(16)])
    between = np.linalg.norm(measured[:, None] - measured[None], axis=-1)
    truth = np.linalg.norm(points[:16, None] - points[None, :16], axis=-1)
    worst_station = float(np.abs(between - truth).max())
    name = template.layout.paper.name
    print(
        f"\n{name}, {len(scans)} page(s): check bars within {worst_bar:.3f} mm, stations within "
        f"{worst_station:.3f} mm (all pairs, across glued pages), marks within {worst_mark:.3f} mm"
    )
    assert worst_bar < BAR_MM
    assert worst_mark < BAR_MM
    assert worst_station < BAR_MM


def glue(template: TemplatePages, scans: list[Array]) -> tuple[list[Array], float]:
    """Where each page's lower left lies when the marks are laid on each other, and their misfit."""
    layout = template.layout
    corner = np.array(layout.paper.corner)
    seen = {
        (mark.name, page): cross_near(
            scans[page - 1], mark.at - layout.tiles[page - 1].low + corner, MARK_ARM_MM
        )
        for mark in layout.marks
        for page in mark.pages
    }
    shifts: dict[int, Array] = {1: layout.tiles[0].low - corner}
    while len(shifts) < len(scans):
        reached = len(shifts)
        for mark in layout.marks:
            for known, new in (mark.pages, mark.pages[::-1]):
                if known in shifts and new not in shifts:
                    pair = [m for m in layout.marks if m.pages == mark.pages]
                    apart = [seen[m.name, known] - seen[m.name, new] for m in pair]
                    shifts[new] = shifts[known] + np.mean(apart, axis=0)
        assert len(shifts) > reached, "the pages do not hang together"
    misfit = [
        float(np.linalg.norm(seen[m.name, a] + shifts[a] - seen[m.name, b] - shifts[b]))
        for m in layout.marks
        for a, b in [m.pages]
    ]
    return [shifts[number] for number in range(1, len(scans) + 1)], max(misfit, default=0.0)


def stations(
    template: TemplatePages, scans: list[Array], points: Array, tangents: Array, shifts: list[Array]
) -> dict[int, Array]:
    """Stations as measured, on the glued sheet: the mean of the tick's two ends [mm]."""
    found = {}
    for tile, scan, shift in zip(template.layout.tiles, scans, shifts, strict=True):
        for k in range(16):
            across = np.array([-tangents[k, 1], tangents[k, 0]])
            ends = points[k] + np.array([[-1], [1]]) * HALF_TICK_MM * across
            if np.all((ends > tile.low + 2) & (ends < tile.high - 2)):
                seen = [line_near(scan, end - shift, tangents[k]) for end in ends]
                found[k] = np.mean(seen, axis=0) + shift
    return found


def test_what_neighbours_share_is_drawn_at_the_same_place_on_both(
    sheet: MakeSheet, tmp_path: Path
) -> None:
    template = sheet("A4")
    scans = pages(pdf_pages(template), tmp_path)
    shifts, _ = glue(template, scans)
    points, tangents = expected(template, parts=1600)
    upper, lower = template.layout.tiles[:2]
    shared = (points[:, 1] > upper.low[1] + 2) & (points[:, 1] < lower.high[1] - 2)
    apart = []
    for point, tangent in zip(points[shared][::5], tangents[shared][::5], strict=True):
        across = np.array([-tangent[1], tangent[0]])
        seen = [
            line_near(scan, point + across - shift, across, reach=0.4) + shift
            for scan, shift in zip(scans[:2], shifts[:2], strict=True)
        ]
        assert seen[0] == pytest.approx(point + across, abs=BAR_MM)
        apart.append(float(np.linalg.norm(seen[0] - seen[1])))
    print(f"\nthe contour in the overlap, {len(apart)} places: {max(apart):.3f} mm apart at most")
    assert len(apart) > 4
    assert max(apart) < BAR_MM


def test_qr_code_on_every_page_tells_shape_and_hash(
    printed: tuple[TemplatePages, list[Array]],
) -> None:
    template, scans = printed
    for scan in scans:
        part = scan[-int(45 / PIXEL_MM) :, : int(45 / PIXEL_MM)]
        picture = (255 * (1 - part)).astype(np.uint8)
        text, *_ = cv2.QRCodeDetector().detectAndDecode(picture)
        assert text == f"thesis-initial {template.strip.sha256[:8]}"


def test_a_compensated_print_comes_out_at_1_to_1_on_the_printer_it_is_for(
    sheet: MakeSheet, tmp_path: Path
) -> None:
    measured = {"H": 99.6, "V": 100.1}
    template = sheet("A4", compensation=Compensation(100 / measured["H"], 100 / measured["V"]))
    (scan, *_) = pages(pdf_pages(template), tmp_path)
    for axis, length in bars(scan):
        printed = length * measured[axis] / 100
        print(f"bar {axis}: {length:.3f} mm in the file, {printed:.3f} mm printed")
        assert printed == pytest.approx(100, abs=BAR_MM)
