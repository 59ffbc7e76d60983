"""Templates at 1:1: the sheet that a strip is bent against.

`strip` is what is shown, and refuses what cannot be bent; `free` takes the load off shapes that
list the standing robot. `drawing` makes one drawing of it in mm (`figure` holds its parts, `labels`
places its texts), `tiles` spreads that over the fewest pages of a `paper`, and a `sheet` is all of
it. Three writers draw the same: `pages` (PDF, with `canvas`, the `block` at the bottom and the
table of `overbend`), `svg` and `dxf`; `files` writes them, `record` keeps what they were drawn
from, and `confirm` judges a print by its check bars. Nothing here reads photographs. A new line on
the sheet is a path of `drawing`, with its layer; a new paper is a row in `paper`.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.template.canvas import NO_COMPENSATION, Compensation
from workbench.template.confirm import AT_SCALE_MM, REFUSED_MM, ConfirmedPrint, confirm_template
from workbench.template.dxf import dxf_drawing
from workbench.template.files import FORMATS, formats_named, write_template
from workbench.template.free import free_angles, free_shape
from workbench.template.metal import Metal, metal_of
from workbench.template.overbend import held_radius, overbends
from workbench.template.pages import pdf_pages
from workbench.template.paper import PAPERS, Paper, paper_named
from workbench.template.sheet import TemplatePages, make_sheet
from workbench.template.strip import LEAST_RADIUS, Strip, make_strip
from workbench.template.svg import svg_drawing

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
