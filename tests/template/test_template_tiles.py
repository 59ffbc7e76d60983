"""How a drawing is spread over pages."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.template.conftest import DAY, MakeSheet
from workbench.errors import InputError
from workbench.schemas import Document, ShapeFile
from workbench.template import make_sheet, make_strip, paper_named
from workbench.template.drawing import Placement, draw_strip
from workbench.template.paper import OVERLAP_MM
from workbench.template.tiles import BORDER_MM


@pytest.mark.parametrize("name", ["A4", "A3", "Letter", "Tabloid", "200x200mm"])
def test_all_that_is_drawn_is_on_a_page_and_no_page_is_empty(sheet: MakeSheet, name: str) -> None:
    layout = sheet(name).layout
    samples = layout.drawing.samples()
    on = np.array([np.all((samples >= t.low) & (samples <= t.high), axis=1) for t in layout.tiles])
    assert on.any(axis=0).all()
    for k in range(len(on)):
        alone = on[k] & ~np.delete(on, k, axis=0).any(axis=0)
        assert alone.any(), f"page {k + 1} shows nothing that no other page shows"


def test_neighbours_overlap_by_15_mm_and_share_two_marks_an_edge(sheet: MakeSheet) -> None:
    layout = sheet("200x200mm").layout
    by_number = {tile.number: tile for tile in layout.tiles}
    pairs = [mark.pages for mark in layout.marks]
    assert len(set(pairs)) == 3  # four pages in a row round a corner
    assert len({mark.name for mark in layout.marks}) == len(layout.marks)
    for mark in layout.marks:
        assert pairs.count(mark.pages) == 2
        cut, below = (by_number[number] for number in mark.pages)
        shared = np.minimum(cut.high, below.high) - np.maximum(cut.low, below.low)
        assert shared.min() == pytest.approx(OVERLAP_MM)
        for tile in (cut, below):
            assert np.all((mark.at >= tile.low) & (mark.at <= tile.high))


def test_pages_are_fewer_than_upright_in_a_full_grid(sheet: MakeSheet) -> None:
    found = {name: len(sheet(name).layout.tiles) for name in ("A4", "A3", "Letter", "Tabloid")}
    print(f"\npages: {found}")
    assert found["A3"] == found["Tabloid"] == 1
    assert found["A4"] <= 3  # upright, 2 x 2
    assert found["Letter"] <= 3


def test_a_drawing_is_turned_only_where_that_saves_paper(sheet: MakeSheet) -> None:
    template = sheet("A3")
    paper = template.layout.paper
    window = np.array([paper.window_width, paper.window_height])
    upright = np.ptp(draw_strip(template.strip, Placement()).samples(), axis=0)
    assert template.layout.turn_deg != 0
    assert np.any(upright + 2 * BORDER_MM > window)
    assert sheet("A4").layout.turn_deg == 0


def test_a_straight_strip_lies_along_the_paper(shape: Callable[..., Document[ShapeFile]]) -> None:
    strip = make_strip(shape(angles=[-1.57] + 15 * [0.0], length="300 mm"), 0.002)
    layout = make_sheet(strip, paper_named("A3"), DAY).layout
    assert len(layout.tiles) == 1
    assert layout.turn_deg == 0
    roll = make_sheet(strip, paper_named("roll", 0.61), DAY).layout
    assert abs(roll.turn_deg) > 75  # across the roll, to use little of it
    assert roll.paper.height is not None
    assert roll.paper.height < 190


def test_mirrored_is_the_other_side(sheet: MakeSheet) -> None:
    there = draw_strip(sheet("A4").strip, Placement()).paths
    other = draw_strip(sheet("A4").strip, Placement(mirror=True)).paths
    for path, twin in zip(there, other, strict=True):
        assert twin.length == pytest.approx(path.length)
        flipped = path.points * [-1, 1]
        apart = np.linalg.norm(twin.points[:, None] - flipped, axis=-1)
        assert apart.min(axis=0).max() < 1e-9


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("A5",), r"unknown paper 'A5'; there is A4, A3, Letter, Tabloid, roll, or a size such as"),
        (("Leter",), r"unknown paper 'Leter'; did you mean 'Letter'\?"),
        (("120x180mm",), r"120 mm x 180 mm is too small; .* need 199 mm x 172 mm"),
        (("roll", 0.15), r"150 mm is too small; .* on a roll 199 mm of width"),
        (("roll",), r'a roll needs its width, for example --roll-width "610 mm"'),
        (("A4", 0.61), r"--roll-width is for --paper roll, not for A4"),
    ],
)
def test_paper_that_cannot_be_used_is_refused(
    words: tuple[str, float | None], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        paper_named(*words)
