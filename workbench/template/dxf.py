"""Write a drawing as DXF in millimetres, exact arcs as bulges, one layer each, for CNC and CAD."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
from ezdxf import filemanagement, units
from ezdxf.enums import TextEntityAlignment

from workbench.template.drawing import Placement, draw_strip
from workbench.template.figure import Anchor, Label, Layer, Path
from workbench.template.sheet import TemplatePages

if TYPE_CHECKING:
    from ezdxf.layouts.layout import Modelspace

__all__ = ["dxf_drawing"]

_COLOURS: dict[Layer, int] = {
    Layer.CONTOUR: 7,
    Layer.CENTRELINE: 1,
    Layer.POLYLINE: 8,
    Layer.STATIONS: 5,
    Layer.FOOT: 7,
    Layer.TIP: 1,
}
"""Layer -> AutoCAD colour index."""
_LINETYPES: dict[Layer, str] = {Layer.CENTRELINE: "CENTER", Layer.POLYLINE: "DASHED"}
_ALIGNMENTS: dict[Anchor, TextEntityAlignment] = {
    "start": TextEntityAlignment.LEFT,
    "middle": TextEntityAlignment.CENTER,
    "end": TextEntityAlignment.RIGHT,
}


def dxf_drawing(sheet: TemplatePages) -> str:
    """Return the DXF: the beam's root at the origin; not turned and not compensated."""
    document = filemanagement.new("R2010", setup=["linetypes"], units=units.MM)
    for layer in Layer:
        document.layers.add(
            layer.value, color=_COLOURS[layer], linetype=_LINETYPES.get(layer, "Continuous")
        )
    space = document.modelspace()
    drawing = draw_strip(sheet.strip, Placement(mirror=sheet.mirror))
    for path in drawing.paths:
        _add_path(space, path)
    for label in drawing.labels:
        _add_label(space, label)
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _add_path(space: Modelspace, path: Path) -> None:
    corners = np.column_stack([path.points, path.bulges])
    space.add_lwpolyline(
        corners.tolist(), format="xyb", close=path.closed, dxfattribs={"layer": path.layer.value}
    )


def _add_label(space: Modelspace, label: Label) -> None:
    text = space.add_text(label.text, height=label.height, dxfattribs={"layer": label.layer.value})
    text.set_placement(label.at.tolist(), align=_ALIGNMENTS[label.anchor])
