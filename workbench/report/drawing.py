"""How every figure of the workbench is drawn, and how it becomes part of a page.

No state of pyplot is touched. In an SVG text stays text, so that it can be found, read aloud and
printed in the page's own face; black becomes `currentColor`, so that one picture serves light and
dark.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["as_svg", "drawn", "legend"]

_INK = "#010203"  # replaces the page's ink until the SVG is written
_WIDTH_IN = 7.6
_PAD = 0.4  # of the font's size, around the figure
_COLORED = dict.fromkeys(
    ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color", "grid.color"),
    _INK,
)
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",  # only to measure; the page sets its own face
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.xmargin": 0.01,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.alpha": 0.18,
    "lines.linewidth": 1.1,
    "path.simplify_threshold": 0.3,
    "legend.frameon": False,
    **_COLORED,
}


def drawn(draw: Callable[[Figure], None], height_in: float) -> Figure:
    """Return a figure of the width of a page, drawn in the house's style.

    Args:
        draw: adds axes and curves to the empty figure.
        height_in: height [inch].
    """
    import matplotlib.figure
    import matplotlib.layout_engine

    tight = matplotlib.layout_engine.TightLayoutEngine(pad=_PAD)
    with matplotlib.rc_context(_STYLE):
        figure = matplotlib.figure.Figure(figsize=(_WIDTH_IN, height_in), layout=tight)
        draw(figure)
        figure.align_ylabels()
        figure.draw_without_rendering()  # labels are aligned after they got their room
    return figure


def legend(ax: Axes) -> None:
    """Place the legend above the axes, where no curve can run under it."""
    ax.legend(loc="lower right", bbox_to_anchor=(1, 0.98), ncols=3, borderaxespad=0.2)


def as_svg(figure: Figure, name: str) -> str:
    """Return a figure as an `<svg>` element without a background.

    Args:
        figure: of `drawn`; its backgrounds are made invisible.
        name: keeps its ids apart from other figures' on the page.
    """
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    text = io.StringIO()
    with rc_context({**_STYLE, "svg.hashsalt": name}):
        figure.patch.set_visible(False)
        for ax in figure.axes:
            ax.patch.set_visible(False)
        FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None})
    return _inline(text.getvalue())


def _inline(document: str) -> str:
    """Turn an SVG file into an element of an HTML page: no prolog, namespaces or doubled ids."""
    svg = document[document.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg)
    svg = re.sub(r' id="[\w.]+_\d+"', "", svg)
    svg = re.sub(r' (width|height)="[\d.]+pt"', "", svg, count=2)
    return svg.replace("xlink:href", "href").replace(_INK, "currentColor")
