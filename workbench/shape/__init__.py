"""The beam's shape as geometry: angles to a curve in the x-z plane.

What a beam of straight increments looks like lives here (`curve`), and the smooth line that a strip
is bent along (`arcs`), in the thesis' convention: angle 0 turns the first increment against the
foot, every further one against its predecessor, about +y. Nothing here knows of forces, files or
drawing. A new property of a shape is a function of the curve.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.shape.arcs import Arcs, Box, crossing, equal_length_arcs
from workbench.shape.curve import bend_radii, curve
from workbench.shape.metrics import Metrics, clearance, metrics

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
