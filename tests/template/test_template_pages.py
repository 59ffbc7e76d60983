"""The PDF as a reader opens it."""

from __future__ import annotations

import io
from collections.abc import Callable

import pypdf
import pytest

from tests.template.conftest import DAY, MakeSheet
from workbench.schemas import Document, ShapeFile
from workbench.template import Compensation, make_sheet, make_strip, paper_named, pdf_pages

POINT_MM = 25.4 / 72


def opened(pdf: bytes) -> pypdf.PdfReader:
    return pypdf.PdfReader(io.BytesIO(pdf))


def words(pdf: bytes, page: int = 0) -> str:
    return " ".join(opened(pdf).pages[page].extract_text().split())


def test_a_viewer_is_asked_not_to_scale(sheet: MakeSheet) -> None:
    preferences = opened(pdf_pages(sheet("A4"))).viewer_preferences
    assert preferences is not None
    assert preferences.print_scaling == "/None"


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("A4", (297.0, 210.0)),
        ("A3", (297.0, 420.0)),
        ("Letter", (279.4, 215.9)),
        ("Tabloid", (279.4, 431.8)),
    ],
)
def test_pages_have_the_paper_s_size(
    sheet: MakeSheet, name: str, size: tuple[float, float]
) -> None:
    for page in opened(pdf_pages(sheet(name))).pages:
        found = (float(page.mediabox.width) * POINT_MM, float(page.mediabox.height) * POINT_MM)
        print(f"{name}: MediaBox {found[0]:.3f} mm x {found[1]:.3f} mm")
        assert page.get("/UserUnit", 1) == 1
        assert found == pytest.approx(size, abs=0.01)


def test_a_roll_is_cut_to_length(sheet: MakeSheet) -> None:
    template = sheet("roll", roll_width=0.61)
    (page,) = opened(pdf_pages(template)).pages
    assert float(page.mediabox.width) * POINT_MM == pytest.approx(610, abs=0.01)
    assert float(page.mediabox.height) * POINT_MM < 300


def test_every_page_says_what_it_is_and_asks_to_be_measured(sheet: MakeSheet) -> None:
    pdf = pdf_pages(sheet("A4"))
    for page in range(3):
        text = words(pdf, page)
        for said in (
            "thesis-initial",
            f"page {page + 1} of 3",
            "shape 07eb4c66",
            "2026-11-21",
            "A4",
            "strip 2 mm thick, 615.01 mm long",
            "check unloaded",
            "the shape file lists the free strip",
            "seen from the robot's right",
            "equal-length arcs",
            "dashed: the model's polyline",
            "H: measure this bar: it must be 100 mm",
            "V: measure this bar: it must be 100 mm",
            "print compensation: none",
        ):
            assert said in text, said


def test_stations_tell_angle_and_radius(sheet: MakeSheet) -> None:
    text = words(pdf_pages(sheet("A3")))
    # alpha_12 = 0.399 rad over 38.438 mm, alpha_1 = 0.010 rad
    stations = ("12 +22.9° R 96 mm", "1 +0.6° R 3844 mm", "0 root -146.6°")
    for said in (*stations, "foot, forward", " T "):
        assert said in f"{text} ", said


def test_pages_tell_where_they_are_cut_and_what_they_cover(sheet: MakeSheet) -> None:
    pdf = pdf_pages(sheet("A4"))
    assert "page 2 comes to here" in words(pdf, 0)
    assert "cut here" not in words(pdf, 0)
    assert "cut here, lay over page 1" in words(pdf, 1)
    assert "cut here, lay over page 2" in words(pdf, 2)


def test_a_mirrored_and_a_compensated_sheet_say_so(sheet: MakeSheet) -> None:
    assert "MIRRORED: seen from the robot's left" in words(pdf_pages(sheet("A4", mirror=True)))
    compensated = sheet("A4", compensation=Compensation(1.004, 0.999))
    assert "COMPENSATED: H x 1.00400, V x 0.99900" in words(pdf_pages(compensated))


def test_a_sheet_of_a_standing_robot_names_the_model_that_freed_it(
    shape: Callable[..., Document[ShapeFile]], sheet: MakeSheet
) -> None:
    template = sheet("A4")
    freed = make_strip(shape(state="loaded"), 0.002, template.strip.angles, "thesis")
    pdf = pdf_pages(make_sheet(freed, paper_named("A4"), template.day))
    assert "the file lists the standing robot (loaded), freed by model thesis" in words(pdf)


def test_the_same_template_has_the_same_bytes(sheet: MakeSheet) -> None:
    assert pdf_pages(sheet("A4")) == pdf_pages(sheet("A4"))


def test_a_name_in_other_letters_is_drawn(shape: Callable[..., Document[ShapeFile]]) -> None:
    strip = make_strip(shape(name="größer 2/3"), 0.002)
    template = make_sheet(strip, paper_named("A3"), DAY)
    assert "größer 2/3" in words(pdf_pages(template))
    assert template.stem.startswith("größer_2_3-")
