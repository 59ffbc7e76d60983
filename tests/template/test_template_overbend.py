"""Springback: the handbooks' equation against the bending of a strip, layer by layer."""

from __future__ import annotations

import io

import numpy as np
import pypdf
import pytest

from tests.template.conftest import DAY, MakeSheet
from workbench.errors import InputError
from workbench.template import (
    Metal,
    held_radius,
    make_sheet,
    metal_of,
    overbends,
    paper_named,
    pdf_pages,
)

THICKNESS = 0.002
ALUMINIUM = Metal(200e6, 70e9)


def released(held: float, thickness: float, metal: Metal, layers: int = 20_001) -> float:
    """The radius that is left, by the moment of many layers, each elastic and then plastic."""
    height = np.linspace(-thickness / 2, thickness / 2, layers)
    stress = np.clip(metal.modulus * height / held, -metal.yield_strength, metal.yield_strength)
    moment = float(np.trapezoid(stress * height, height))
    return 1 / (1 / held - moment * 12 / (metal.modulus * thickness**3))


@pytest.mark.parametrize("radius", [0.02, 0.096, 0.2, 1.0, 3.844])
def test_a_strip_held_at_the_radius_told_springs_back_to_the_shape(radius: float) -> None:
    held = held_radius(radius, THICKNESS, ALUMINIUM)
    left = released(held, THICKNESS, ALUMINIUM)
    print(f"R {1000 * radius:.0f} mm: hold {1000 * held:.2f} mm, {1000 * left:.2f} mm is left")
    assert left == pytest.approx(radius, rel=1e-4)
    assert held < ALUMINIUM.modulus * THICKNESS / (2 * ALUMINIUM.yield_strength)  # 350 mm


def test_a_straight_station_stays_straight() -> None:
    assert held_radius(float("inf"), THICKNESS, ALUMINIUM) == float("inf")


def test_every_station_is_held_tighter_the_same_way(sheet: MakeSheet) -> None:
    strip = sheet("A4").strip
    bends = overbends(strip, ALUMINIUM)
    assert [bend.station for bend in bends] == list(range(1, 16))
    for bend in bends:
        assert bend.held_radius < bend.radius
        assert np.sign(bend.held_bend) == np.sign(bend.bend)
        assert abs(bend.held_bend) * bend.held_radius == pytest.approx(strip.length / 16)


def test_the_radii_are_on_a_page_of_their_own(sheet: MakeSheet) -> None:
    strip = sheet("A4").strip
    template = make_sheet(strip, paper_named("A3"), DAY, metal=ALUMINIUM)
    pages = pypdf.PdfReader(io.BytesIO(pdf_pages(template))).pages
    assert len(pages) == template.pages == 2
    text = " ".join(pages[1].extract_text().split())
    assert "page 2 of 2" in text
    assert "yield strength 200 MPa, modulus 70 GPa" in text
    assert "above a held radius of 350 mm" in text
    held = 1000 * held_radius(0.0384380 / 0.399, THICKNESS, ALUMINIUM)
    assert f"12 461.3 +22.9 96 {held:.0f}" in text
    assert "measure this bar" in text


def test_numbers_of_no_metal_are_refused() -> None:
    assert metal_of(None, None) is None
    assert metal_of(200e6, 70e9) == ALUMINIUM
    with pytest.raises(InputError, match=r"springback needs both: --yield and --modulus"):
        metal_of(200e6, None)
    with pytest.raises(InputError, match=r"no metal yields at 70000 MPa with a modulus of 0\.2"):
        metal_of(70e9, 200e6)
