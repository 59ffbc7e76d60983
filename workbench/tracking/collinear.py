"""The point of a body with collinear markers, which determine a direction but no pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["LinePoint", "point_on_line"]

_OFF_CENTRE_M = 1e-3
_ALONG_Y = 0.7  # cosine; a line nearer to the axis of rotation hardly shows the rotation


class LinePoint(NamedTuple):
    """A point of a body whose markers lie on a line.

    Args:
        position: (n, 3) [m].
        pitch: (n,) rotation about +y [rad], or None.
        source: what the point is.
        warnings: sentences.
    """

    position: NDArray[np.float64]
    pitch: NDArray[np.float64] | None
    source: str
    warnings: tuple[str, ...]


def point_on_line(
    name: str, cloud: NDArray[np.float64], places: NDArray[np.float64] | None
) -> LinePoint:
    """Return a body's point where all its markers are visible.

    Without places it is their centroid. With places the centroid's offset from the body's point is
    taken off: the part along the line always; the part across it only where the line lies nearer to
    the x-z plane than to y, so that its direction gives the rotation about +y (motion in that plane
    assumed), and is long enough there not to amplify its noise. Else a warning states the offset.

    Args:
        name: of the body, for messages.
        cloud: (n, m, 3) markers on a line [m], NaN where not seen.
        places: (m, 3) on the body, forward, left, up [m]; None if not given.
    """
    middle = np.einsum("nmi->ni", cloud) / cloud.shape[1]
    centre = np.zeros(3) if places is None else places.mean(axis=0)
    if places is None or np.linalg.norm(centre) <= _OFF_CENTRE_M:
        return LinePoint(middle, None, "centroid of the {} markers", ())
    if len(places) < 2:
        return LinePoint(middle, None, "the {} marker", (_uncorrected(name, centre),))
    seen, given = _direction(cloud[:, -1] - cloud[:, 0]), places[-1] - places[0]
    line = given / np.linalg.norm(given)
    warnings = []
    lengthwise = abs(line[1]) > _ALONG_Y
    if lengthwise and np.nanmedian(seen[:, 1]) * line[1] < 0:
        seen = -seen
        warnings.append(f"markers of {name!r}: their places fit the other way round; used so")
    along = float(centre @ line)
    across = centre - along * line
    point = middle - along * seen
    source = "body origin, found along the line of the {} markers"
    if np.linalg.norm(across) <= _OFF_CENTRE_M:
        return LinePoint(point, None, source, tuple(warnings))
    if lengthwise or np.hypot(given[0], given[2]) < np.linalg.norm(across):
        warnings.append(_uncorrected(name, across))
        return LinePoint(point, None, source, tuple(warnings))
    pitch = _pitch(seen, line)
    source = "body origin, found by the line of the {} markers, rotation about y assumed"
    return LinePoint(point - _about_y(across, pitch), pitch, source, tuple(warnings))


def _pitch(seen: NDArray[np.float64], line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation about +y of directions (n, 3) from a line (3,), (n,) [rad]."""
    turned = np.arctan2(-seen[:, 2], seen[:, 0]) - np.arctan2(-line[2], line[0])
    return np.arctan2(np.sin(turned), np.cos(turned))


def _uncorrected(name: str, off: NDArray[np.float64]) -> str:
    return (
        f"the markers of {name!r} have their centroid {1e3 * np.linalg.norm(off):.1f} mm off the "
        "body's point across their line; fewer than 3 markers do not show the rotation about it, "
        "so this is not corrected"
    )


def _direction(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.full_like(vectors, np.nan), where=length > 0)


def _about_y(vector: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a vector (3,) turned about +y by each angle (n,): (n, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vector
    return np.column_stack([c * x + s * z, np.full_like(c, y), c * z - s * x])
