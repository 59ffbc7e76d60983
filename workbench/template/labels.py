"""Find a free place for every label, beside what it belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.template.figure import Anchor, Label, Layer

__all__ = ["LabelRequest", "place_labels"]

Array = NDArray[np.float64]

_HEIGHT_MM = 2.5
_GAP_MM = 1.5  # between a label and what it belongs to
_CLEAR_MM = 0.8  # around a label
_TRIES = ((1, 0.0), (1, 4.0), (1, 8.0), (-1, 0.0), (-1, 4.0), (1, 14.0), (-1, 10.0))
"""Side and how much further away [mm], in the order in which they are tried."""
_SIDEWAYS = 0.38  # least share of a direction along x that puts a label beside, not above


@dataclass(frozen=True)
class LabelRequest:
    """A label without its place.

    Args:
        layer: what it belongs to.
        text: one line.
        point: (2,) what it labels [mm].
        towards: (2,) unit vector to where it should be [1]; else it goes to the other side.
        clear: how far from the point it begins [mm].
    """

    layer: Layer
    text: str
    point: Array
    towards: Array
    clear: float


def place_labels(wanted: Sequence[LabelRequest], obstacles: Array) -> tuple[Label, ...]:
    """Return the labels where they hide nothing, as far as there is such a place.

    Args:
        wanted: in the order in which they choose.
        obstacles: (n, 2) points that a label should not lie on [mm].
    """
    placed: list[Label] = []
    for want in wanted:
        choices = list(_choices(want))
        hidden = [_hidden(choice, placed, obstacles) for choice in choices]
        placed.append(choices[int(np.argmin(hidden))])
    return tuple(placed)


def _choices(want: LabelRequest) -> Iterator[Label]:
    for sign, further in _TRIES:
        side = sign * want.towards
        yield _label(want, want.point + (want.clear + _GAP_MM + further) * side, side)


def _label(want: LabelRequest, point: Array, side: Array) -> Label:
    anchor: Anchor = "middle"
    if abs(side[0]) > _SIDEWAYS:
        anchor = "start" if side[0] > 0 else "end"
    drop = _HEIGHT_MM * (0.35 - 0.45 * side[1])  # a label below hangs from the point
    return Label(want.layer, want.text, point - [0.0, drop], anchor, _HEIGHT_MM)


def _hidden(label: Label, placed: Sequence[Label], obstacles: Array) -> int:
    """Return how much a label would hide: other labels count most."""
    low, high = label.corners + np.array([[-_CLEAR_MM], [_CLEAR_MM]])
    lines = int(np.all((obstacles > low) & (obstacles < high), axis=1).sum())
    others = sum(
        bool(np.all(low < other.corners[1]) and np.all(high > other.corners[0])) for other in placed
    )
    return lines + 1000 * others
