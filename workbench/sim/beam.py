"""The beam as a chain of hinges: any number of increments for one and the same strip.

The model's stiffness and damping are those of a chain of as many increments as the shape lists (16
in the thesis). Each listed hinge represents the strip half an increment to either side of it: its
bend and its compliance are uniform there, the two end halves stay straight and rigid. A chain of
another number of increments distributes the strip between two of its hinges to both by the lever
rule. So the whole strip bends by the same angle about the same point under the same moment for any
number of increments, and the discretisation error falls with its square.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Hinge", "hinges"]

_RIGID = 1e-12  # [rad/(N m)] a hinge of less compliance is left out


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
    listed = len(angles)
    share = _shares(listed, increments)
    bend = share @ np.asarray(angles[1:], dtype=float)
    compliance = share.sum(axis=1) / values["hinge_stiffness"]
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


def _shares(listed: int, increments: int) -> NDArray[np.float64]:
    """Return the share of each listed hinge but the root in each hinge of a chain, (n, l - 1).

    Sum and first moment of the strip are kept. There is no hinge at the far end of the chain, where
    T is fixed to it: its share goes to the two before it.
    """
    begin = np.arange(listed - 1) + 0.5  # a listed hinge k covers k - 1/2 to k + 1/2 increments
    cell = listed / increments
    past = (np.arange(-1, increments + 2) * cell)[:, None] - begin
    moment = np.clip(past, 0.0, 1.0) ** 2 / 2 + np.maximum(past - 1.0, 0.0)
    share = np.diff(moment, n=2, axis=0) / cell
    end = share[-1]
    share[-2] += 2 * end
    share[-3] -= end
    return share[:-1]


def _listed(angles: Sequence[float], values: Mapping[str, float]) -> tuple[Hinge, ...]:
    return tuple(
        Hinge(angle, values[f"{kind}_stiffness"], values[f"{kind}_damping"])
        for kind, angle in zip(["root"] + ["hinge"] * (len(angles) - 1), angles, strict=True)
    )
