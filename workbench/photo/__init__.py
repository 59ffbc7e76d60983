"""Read a bent strip back: a photograph of it on a marker board in, 16 angles out, and how sure.

The board's geometry lives here (`board`), its printed page (`board_page`), whether that is at 1:1
(`print_scale`), the way from pixels to
the board's plane (`markers`, `camera`), the strip found and refined in the picture (`strip`,
`edges`), the arcs fitted to it (`fit`), and angles or points that were measured by hand (`manual`).
What a deviation means for the robot does not: that is `as_built`. Only `opencv` imports OpenCV, and
only when it is used. A new board is a row in `board`, a new tape a row in `strip`.
"""

from typing import TYPE_CHECKING

from workbench.photo.board import BOARDS, FOOT_TURN_RAD, Board, find_board
from workbench.photo.board_page import CHECK_BAR_MM, write_board
from workbench.photo.manual import read_angles, read_points
from workbench.photo.print_scale import printed_scale
from workbench.photo.reading import FOOT_SIGMA_RAD, AsBent, read_photo
from workbench.photo.strip import TAPES
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
