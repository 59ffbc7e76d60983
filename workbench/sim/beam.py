"""The beam as a chain of hinges: any number of increments for one and the same strip.

The model's stiffness and damping are those of a chain of as many increments as the shape lists (16
in the thesis). Each listed hinge represents the strip half an increment to either side of it: its
compliance is uniform there, the two end halves stay straight and rigid. The strip bends by each
listed angle within that hinge's part, smoothly: its direction is the natural cubic spline through
the ends of the parts. A chain of another number of increments distributes the strip between two of
its hinges to both by the lever rule. So the whole strip turns by the same angle under the same
moment for any number of increments, and the discretisation error falls with its square.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["Hinge", "hinges"]

_RIGID = 1e-12  # [rad/(N m)] a hinge of less compliance is left out
_KEPT = 64  # shapes; a fit starts one of them thousands of times


class Hinge(NamedTuple):
    """One hinge of the chain.

    Args:
        angle: at rest, without load [rad].
        stiffness: [N m/rad]; None where the chain is rigid.
        damping: [N m s/rad].
    """

    angle: float
    stiffness: float | None
    damping: float


def hinges(
    angles: Sequence[float], values: Mapping[str, float], increments: int
) -> tuple[Hinge, ...]:
    """Return the hinges of a chain; the first joins it to the foot.

    Args:
        angles: the listed ones, alpha_0 first [rad].
        values: stiffness and damping of the listed chain, SI.
        increments: how many the chain shall have, at least two.
    """
    if increments == len(angles):
        return _listed(angles, values)
    bend = _bends(tuple(angles), increments)
    compliance = _yielding(len(angles), increments) / values["hinge_stiffness"]
    ratio = values["hinge_damping"] / values["hinge_stiffness"]
    root = 1 / (1 / values["root_stiffness"] + compliance[0])
    chain = [
        Hinge(
            float(angles[0] + bend[0]),
            root,
            values["root_damping"] * root / values["root_stiffness"],
        )
    ]
    for angle, yielding in zip(bend[1:], compliance[1:], strict=True):
        stiffness = None if yielding < _RIGID else float(1 / yielding)
        chain.append(Hinge(float(angle), stiffness, ratio * (stiffness or 0.0)))
    return tuple(chain)


@lru_cache(_KEPT)
def _bends(angles: tuple[float, ...], increments: int) -> NDArray[np.float64]:
    """Return the angle at rest of each hinge of a chain but for alpha_0, (n,) [rad]."""
    ends = np.arange(len(angles)) + 0.5  # of the listed hinges' parts, in listed increments
    turned = np.concatenate([[0.0], np.cumsum(angles[1:])])
    direction = scipy.interpolate.CubicSpline(ends, turned, bc_type="natural")
    places = _places(len(angles), increments)
    sideways = direction.antiderivative()(np.clip(places, ends[0], ends[-1]))
    return _by_levers(sideways + np.maximum(places - ends[-1], 0.0) * turned[-1], places)


@lru_cache(_KEPT)
def _yielding(listed: int, increments: int) -> NDArray[np.float64]:
    """Return how much each hinge of a chain yields, (n,) [of a listed hinge]."""
    places = _places(listed, increments)
    past = np.clip(places - 0.5, 0.0, listed - 1.0)
    return _by_levers(past**2 / 2 + np.maximum(places - listed + 0.5, 0.0) * (listed - 1), places)


def _places(listed: int, increments: int) -> NDArray[np.float64]:
    """Return the places of a chain's hinges and one beyond each end, (n + 3,) [increments]."""
    return np.arange(-1, increments + 2) * listed / increments


def _by_levers(twice: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what a chain's hinges have of what lies along the strip, (n,).

    Sum and first moment are kept. There is no hinge at the far end of the chain, where T is fixed
    to it: its share goes to the two before it.

    Args:
        twice: (n + 3,) the strip's density, integrated twice up to each place.
        places: (n + 3,) of `_places` [increments].
    """
    share = np.diff(twice, n=2) / (places[1] - places[0])
    end = share[-1]
    share[-2] += 2 * end
    share[-3] -= end
    return share[:-1]


def _listed(angles: Sequence[float], values: Mapping[str, float]) -> tuple[Hinge, ...]:
    return tuple(
        Hinge(angle, values[f"{kind}_stiffness"], values[f"{kind}_damping"])
        for kind, angle in zip(["root"] + ["hinge"] * (len(angles) - 1), angles, strict=True)
    )
