"""The beam's shape as geometry: angles to a curve in the x-z plane.

What a beam of straight increments looks like lives here, in the thesis' convention: angle 0 turns
the first increment against the foot, every further one against its predecessor, about +y. Nothing
here knows of forces, files or drawing. A new property of a shape is a function of the curve.
"""

from workbench.shape.curve import bend_radii, curve
from workbench.shape.metrics import Metrics, clearance, crosses_itself, metrics

__all__ = ["Metrics", "bend_radii", "clearance", "crosses_itself", "curve", "metrics"]
