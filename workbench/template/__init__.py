"""Templates at 1:1: the sheet that a strip is bent against.

`strip` is what is shown, and refuses what cannot be bent; `free` takes the load off shapes that
list the standing robot. `drawing` makes one drawing of it in mm (`figure` holds its parts, `labels`
places its texts), `tiles` spreads that over the fewest pages of a `paper`, and a `sheet` is all of
it. Three writers draw the same: `pages` (PDF, with `canvas` and the `block` at the bottom), `svg`
and `dxf`. Nothing here reads photographs. A new line on the sheet is a path of `drawing`, with its
layer; a new paper is a row in `paper`.
"""

from workbench.template.canvas import NO_COMPENSATION, Compensation
from workbench.template.free import free_angles
from workbench.template.pages import pdf_pages
from workbench.template.paper import PAPERS, Paper, paper_named
from workbench.template.sheet import Sheet, make_sheet
from workbench.template.strip import LEAST_RADIUS, Strip, make_strip

__all__ = [
    "LEAST_RADIUS",
    "NO_COMPENSATION",
    "PAPERS",
    "Compensation",
    "Paper",
    "Sheet",
    "Strip",
    "free_angles",
    "make_sheet",
    "make_strip",
    "paper_named",
    "pdf_pages",
]
