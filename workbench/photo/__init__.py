"""Read a bent strip back: a photograph of it on a marker board, 16 angles with uncertainties out.

The board's geometry lives here (`board`), its printed page (`board_page`), the way from pixels to
the board's plane (`markers`, `camera`), the strip found and refined in the picture (`strip`,
`edges`), the arcs fitted to it (`fit`), and angles or points that were measured by hand (`manual`).
What a deviation means for the robot does not: that is `readback`. Only this room imports OpenCV,
and only when it is used.
"""

from workbench.photo.reading import AsBent, read_photo

__all__ = ["AsBent", "read_photo"]
