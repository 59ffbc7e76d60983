"""SVG and DXF for laser and CNC, read by other programs' eyes."""

from __future__ import annotations

import io
import math
import re
from itertools import pairwise
from xml.etree import ElementTree

import ezdxf.filemanagement
import numpy as np
import pytest
from ezdxf.document import Drawing
from ezdxf.entities.lwpolyline import LWPolyline
from ezdxf.path import make_path

from tests.template.conftest import MakeSheet
from tests.template.raster import walked
from workbench.template import dxf_drawing, svg_drawing

LENGTH_MM, BAR_MM = 615.00, 0.01
LAYERS = {"contour", "centreline", "polyline", "stations", "foot", "tip"}


def opened(text: str) -> Drawing:
    return ezdxf.filemanagement.read(io.StringIO(text))


def polylines(document: Drawing, layer: str) -> list[LWPolyline]:
    found = document.modelspace().query(f'LWPOLYLINE[layer=="{layer}"]')
    return [entity for entity in found if isinstance(entity, LWPolyline)]


def flattened(polyline: LWPolyline) -> np.ndarray:
    """Corners of straight pieces within 0.5 um of it, by ezdxf's own reading [mm]."""
    return np.array([point.xyz[:2] for point in make_path(polyline).flattening(0.0005)])


def bulged_length(polyline: LWPolyline) -> float:
    """Length by the definition of a bulge, in mm."""
    corners = list(polyline.get_points("xyb"))
    total = 0.0
    for (x, y, bulge), (u, v, _) in pairwise(corners):
        chord, sweep = math.hypot(u - x, v - y), 4 * math.atan(abs(bulge))
        total += chord if sweep == 0 else chord * sweep / 2 / math.sin(sweep / 2)
    return total


def test_dxf_passes_the_audit_and_is_in_mm_with_named_layers(sheet: MakeSheet) -> None:
    document = opened(dxf_drawing(sheet("A4")))
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes
    assert document.header["$INSUNITS"] == 4  # millimetres
    assert {layer.dxf.name for layer in document.layers} >= LAYERS
    assert {entity.dxf.layer for entity in document.modelspace()} == LAYERS


def test_dxf_centreline_is_615_mm_of_arcs(sheet: MakeSheet) -> None:
    (centreline,) = polylines(opened(dxf_drawing(sheet("A4"))), "centreline")
    exact = bulged_length(centreline)
    corners = flattened(centreline)
    flat = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
    print(f"\nDXF: {exact:.4f} mm by its bulges, {flat:.4f} mm flattened; bar 615.00 +- 0.01")
    assert abs(exact - LENGTH_MM) < BAR_MM
    assert abs(flat - LENGTH_MM) < BAR_MM


def test_dxf_contour_is_one_closed_line_half_the_thickness_off(sheet: MakeSheet) -> None:
    template = sheet("A4")
    (contour,) = polylines(opened(dxf_drawing(template)), "contour")
    assert contour.closed
    points, heading = walked(np.array(template.strip.angles), template.strip.length)
    normals = np.stack([np.sin(heading), np.cos(heading)], axis=1)
    outline = flattened(contour)
    for side in (-1.0, 1.0):
        for expected in points + side * normals:
            # the distance to the nearest piece of the flattened outline
            start, end = outline, np.roll(outline, -1, axis=0)
            along = np.sum((expected - start) * (end - start), axis=1)
            share = np.clip(along / np.maximum(np.sum((end - start) ** 2, axis=1), 1e-12), 0, 1)
            nearest = start + share[:, None] * (end - start)
            assert np.linalg.norm(nearest - expected, axis=1).min() < 0.01


def svg_paths(text: str, layer: str) -> list[str]:
    root = ElementTree.fromstring(text)
    space = "{http://www.w3.org/2000/svg}"
    (group,) = [g for g in root.iter(f"{space}g") if g.get("id") == layer]
    return [str(path.get("d")) for path in group.iter(f"{space}path")]


def svg_length(course: str) -> float:
    """Length of a path of M, L and A commands by their definition."""
    total, x, y = 0.0, 0.0, 0.0
    for letter, rest in re.findall(r"([MLA]) ([^MLAZ]*)", course):
        numbers = [float(word) for word in rest.split()]
        u, v = numbers[-2:]
        chord = math.hypot(u - x, v - y)
        if letter == "L":
            total += chord
        elif letter == "A":
            radius, large = numbers[0], numbers[3]
            half = math.asin(min(1.0, chord / 2 / radius))
            total += 2 * radius * (math.pi - half if large else half)
        x, y = u, v
    return total


def test_svg_centreline_is_615_mm_and_a_unit_is_a_millimetre(sheet: MakeSheet) -> None:
    text = svg_drawing(sheet("A4"))
    (course,) = svg_paths(text, "centreline")
    length = svg_length(course)
    print(f"\nSVG: {length:.4f} mm; bar 615.00 +- 0.01")
    assert abs(length - LENGTH_MM) < BAR_MM
    root = ElementTree.fromstring(text)
    _, _, width, height = (float(word) for word in str(root.get("viewBox")).split())
    assert root.get("width") == f"{width:.4f}mm"
    assert root.get("height") == f"{height:.4f}mm"
    groups = {g.get("id") for g in root.iter("{http://www.w3.org/2000/svg}g")}
    assert groups == LAYERS


def test_svg_and_dxf_have_the_same_corners(sheet: MakeSheet) -> None:
    template = sheet("A4", mirror=True)
    (course,) = svg_paths(svg_drawing(template), "centreline")
    (centreline,) = polylines(opened(dxf_drawing(template)), "centreline")
    ends = [
        [float(word) for word in rest.split()[-2:]]
        for _, rest in re.findall(r"([MLA]) ([^MLAZ]*)", course)
    ]
    drawn = np.array([point[:2] for point in centreline.get_points("xyb")])
    assert np.array(ends) * [1, -1] == pytest.approx(drawn, abs=1e-5)
    stations, _ = walked(np.array(template.strip.angles), template.strip.length)
    assert drawn[-1] == pytest.approx(stations[-1] * [-1, 1], abs=1e-4)
