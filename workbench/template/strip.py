"""What a template shows: the free strip of a shape, checked to be one that can be bent."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.schemas import Document, ShapeFile
from workbench.shape import Arcs, bend_radii, crossing, equal_length_arcs

__all__ = ["LEAST_RADIUS", "Strip", "digest", "make_strip"]

LEAST_RADIUS = 5.0
"""Least radius of the centreline over the thickness. In tighter bends the neutral axis leaves the
middle of the strip, so that its length is no longer the beam's."""

_SHORT = 8  # hexadecimal digits of a hash that are shown to people
_SAMPLE_M = 2e-3  # between the points that sample a contour


@dataclass(frozen=True)
class Strip:
    """The free strip.

    Args:
        name: of the shape.
        sha256: of the shape file's text.
        angles: (N,) alpha_0 to alpha_{N-1} of the free strip [rad].
        length: along the centreline [m].
        thickness: [m].
        model: through which the angles of a standing robot were turned into these; None where the
            file lists the free strip.
    """

    name: str
    sha256: str
    angles: tuple[float, ...]
    length: float
    thickness: float
    model: str | None = None

    @property
    def short_hash(self) -> str:
        """Return the first digits of the hash, as people compare them."""
        return self.sha256[:_SHORT]

    @property
    def centreline(self) -> Arcs:
        """Return the line that the strip is bent along, from its root [m]."""
        return equal_length_arcs(self.angles, self.length)


def digest(shape: Document[ShapeFile]) -> str:
    """Return the sha256 of a shape file's text, the same on every system."""
    return hashlib.sha256(shape.text.encode("utf-8")).hexdigest()


def make_strip(
    shape: Document[ShapeFile],
    thickness: float | None = None,
    angles: tuple[float, ...] | None = None,
    model: str | None = None,
) -> Strip:
    """Return the strip of a shape.

    Args:
        shape: as read.
        thickness: of the strip at hand [m]; by default the file's.
        angles: of the free strip [rad], where the file lists those of the standing robot.
        model: that they were found with.

    Raises:
        InputError: when the thickness is unknown or contradicts the file, when the file lists the
            standing robot and no other angles are given, and when the strip cannot be bent so.
    """
    file = shape.content
    if angles is None and file.state == "loaded":
        raise InputError(
            f"{shape.path}: lists the angles of the standing robot; a template shows the free "
            "strip, so it needs the angles without load and the model that gave them"
        )
    strip = Strip(
        file.name,
        digest(shape),
        angles or file.angles,
        file.length,
        _thickness(shape, thickness),
        model,
    )
    _require_wide_bends(strip)
    _require_no_crossing(strip)
    return strip


def _thickness(shape: Document[ShapeFile], stated: float | None) -> float:
    listed = shape.content.thickness
    if stated is None and listed is None:
        raise InputError(
            f"{shape.path}: the strip's thickness is unknown and is never guessed; measure the "
            'strip and give it, for example --thickness "2 mm", or write `thickness: 2 mm` there'
        )
    if stated is not None and listed is not None and not np.isclose(stated, listed):
        raise InputError(
            f"{shape.path}: says that the strip is {1000 * listed:g} mm thick, --thickness says "
            f"{1000 * stated:g} mm; correct the one that is wrong"
        )
    return stated if stated is not None else float(listed or 0.0)


def _require_wide_bends(strip: Strip) -> None:
    radii = bend_radii(strip.angles, strip.length)
    least = LEAST_RADIUS * strip.thickness
    tight = [k for k, radius in enumerate(radii, start=1) if radius < least]
    if not tight:
        return
    listed = ", ".join(f"{k} ({1000 * radii[k - 1]:.1f} mm)" for k in tight)
    raise InputError(
        f"{strip.name}: a strip {1000 * strip.thickness:g} mm thick cannot be bent to a radius "
        f"below {1000 * least:g} mm, {LEAST_RADIUS:g} times its thickness; too tight at station "
        f"{listed}; take a thinner strip or a shape with less bend there"
    )


def _require_no_crossing(strip: Strip) -> None:
    line = strip.centreline
    half = strip.thickness / 2
    outer, inner = line.offset(half), line.offset(-half)
    share = np.linspace(0, 1, int(np.ceil(strip.length / _SAMPLE_M)) + 1)
    along = share * strip.length
    outline = np.concatenate(
        [
            outer.points_at(np.interp(along, line.knots, outer.knots)),
            inner.points_at(np.interp(along[::-1], line.knots, inner.knots)),
        ]
    )
    found = crossing(outline)
    if found is None:
        return
    where = np.concatenate([along, along[::-1]])[list(found)]
    step = strip.length / len(strip.angles)
    first, second = sorted(int(k) for k in np.round(where / step))
    raise InputError(
        f"{strip.name}: the strip, {1000 * strip.thickness:g} mm thick, would cross itself near "
        f"stations {first} and {second}; such a shape cannot be bent"
    )
