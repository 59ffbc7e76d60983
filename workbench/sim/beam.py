"""The beam as a chain of hinges: any number of increments for one and the same strip.

The model's stiffness and damping are those of a chain of as many increments as the shape lists (16
in the thesis). Each listed hinge stands for the strip half an increment to either side of it: its
bend and its compliance are spread evenly there, the two end halves stay straight and rigid. A chain
of another number of increments gathers what lies around each of its own hinges. So the whole strip
bends by the same angle under the same moment, whatever the number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

__all__ = ["Hinge", "hinges"]

_RIGID = 1e-12  # [rad/(N m)] a hinge that yields less is none


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
        increments: how many the chain shall have.
    """
    if increments == len(angles):
        return _listed(angles, values)
    listed = len(angles)
    edge = np.arange(listed) - 0.5  # a listed hinge k covers k - 1/2 to k + 1/2 increments
    cell = listed / increments
    bounds = np.concatenate([[0.0], (np.arange(increments) + 0.5) * cell])
    covered = np.clip(bounds[:, None] - edge[None, 1:], 0.0, 1.0)
    bend = np.diff(covered @ np.asarray(angles[1:], dtype=float))
    compliance = np.diff(covered.sum(axis=1)) / values["hinge_stiffness"]
    ratio = values["hinge_damping"] / values["hinge_stiffness"]
    root = 1 / (1 / values["root_stiffness"] + compliance[0])
    chain = [
        Hinge(
            float(angles[0] + bend[0]),
            root,
            values["root_damping"] * root / values["root_stiffness"],
        )
    ]
    for turn, yielding in zip(bend[1:], compliance[1:], strict=True):
        stiffness = None if yielding < _RIGID else float(1 / yielding)
        chain.append(Hinge(float(turn), stiffness, ratio * (stiffness or 0.0)))
    return tuple(chain)


def _listed(angles: Sequence[float], values: Mapping[str, float]) -> tuple[Hinge, ...]:
    return tuple(
        Hinge(angle, values[f"{kind}_stiffness"], values[f"{kind}_damping"])
        for kind, angle in zip(["root"] + ["hinge"] * (len(angles) - 1), angles, strict=True)
    )
