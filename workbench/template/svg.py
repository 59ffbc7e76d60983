"""Write a drawing as SVG in millimetres, one group a layer, for laser cutters and Inkscape."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from workbench.template.drawing import Placement, draw_strip
from workbench.template.figure import Label, Layer, Path, arc
from workbench.template.pages import PENS
from workbench.template.sheet import TemplatePages

__all__ = ["svg_drawing"]

_BORDER_MM = 5.0
_SVG = "http://www.w3.org/2000/svg"
_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"


def svg_drawing(sheet: TemplatePages) -> str:
    """Return the SVG: one user unit is 1 mm, x to the right; not turned and not compensated."""
    drawing = draw_strip(sheet.strip, Placement(mirror=sheet.mirror))
    samples = drawing.samples()
    low, high = samples.min(axis=0) - _BORDER_MM, samples.max(axis=0) + _BORDER_MM
    width, height = (high - low).tolist()
    for prefix, space in (("", _SVG), ("inkscape", _INKSCAPE)):
        ElementTree.register_namespace(prefix, space)
    root = ElementTree.Element(
        f"{{{_SVG}}}svg",
        {
            "width": f"{width:.4f}mm",
            "height": f"{height:.4f}mm",
            "viewBox": f"{low[0]:.4f} {-high[1]:.4f} {width:.4f} {height:.4f}",
        },
    )
    title = ElementTree.SubElement(root, f"{{{_SVG}}}title")
    title.text = f"{sheet.strip.name} {sheet.strip.short_hash}"
    for layer in Layer:
        group = _group(root, layer)
        for path in drawing.layer(layer):
            ElementTree.SubElement(group, f"{{{_SVG}}}path", {"d": _course(path)})
        for label in drawing.labels:
            if label.layer is layer:
                _write(group, label)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _group(root: ElementTree.Element, layer: Layer) -> ElementTree.Element:
    pen = PENS[layer]
    colour = "#" + "".join(f"{round(255 * part):02x}" for part in pen.colour)
    style = f"fill:none;stroke:{colour};stroke-width:{pen.width:g}"
    if pen.dashes:
        style += ";stroke-dasharray:" + ",".join(f"{length:g}" for length in pen.dashes)
    return ElementTree.SubElement(
        root,
        f"{{{_SVG}}}g",
        {
            "id": layer.value,
            f"{{{_INKSCAPE}}}groupmode": "layer",
            f"{{{_INKSCAPE}}}label": layer.value,
            "style": style,
        },
    )


def _course(path: Path) -> str:
    """Return the `d` of a path; y points down there."""
    words = [f"M {_point(path.points[0])}"]
    for start, end, bulge in path.pieces:
        found = arc(start, end, bulge)
        if found is None:
            words.append(f"L {_point(end)}")
            continue
        large, clockwise = int(abs(found.sweep) > np.pi), int(found.sweep < 0)
        words.append(f"A {found.radius:.6f} {found.radius:.6f} 0 {large} {clockwise} {_point(end)}")
    return " ".join(words + (["Z"] if path.closed else []))


def _point(point: np.ndarray) -> str:
    return f"{point[0]:.6f} {-point[1]:.6f}"


def _write(group: ElementTree.Element, label: Label) -> None:
    colour = "#" + "".join(f"{round(255 * part):02x}" for part in PENS[label.layer].colour)
    text = ElementTree.SubElement(
        group,
        f"{{{_SVG}}}text",
        {
            "x": f"{label.at[0]:.3f}",
            "y": f"{-label.at[1]:.3f}",
            "text-anchor": label.anchor,
            "font-size": f"{label.height:g}",
            "font-family": "sans-serif",
            "style": f"fill:{colour};stroke:none",
        },
    )
    text.text = label.text
