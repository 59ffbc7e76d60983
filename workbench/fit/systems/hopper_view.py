"""How the cameras see the hopping plane where they are not what they are said to be.

A point p of the plane is seen at S p + constant, S = (1 + share) turn(tilt). The point taken for T
sits off T on its body. With no such effect S is the identity and the point is T.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["VIEWS", "View"]

Array = NDArray[np.float64]

VIEWS = ("camera_tilt", "length_scale", "marker_offset")
"""Effects that act on what is seen of a pose, not on the pose."""


@dataclass(frozen=True)
class View:
    """What the cameras make of a pose.

    Args:
        tilt: of their vertical about the sideways axis [rad].
        share: by which places are too large.
        forward: of the point taken for T, from T at rest [m].
        up: the same upward [m].
    """

    tilt: float = 0.0
    share: float = 0.0
    forward: float = 0.0
    up: float = 0.0

    @classmethod
    def of(cls, effects: Mapping[str, Mapping[str, float]]) -> View:
        """Return the view of a robot with some effects."""
        given = [effects.get(name, {}) for name in VIEWS]
        return cls(**{key: value for one in given for key, value in one.items()})

    @property
    def matrix(self) -> Array:
        """Return S, (2, 2) [1], of places forward and up."""
        c, s = np.cos(self.tilt), np.sin(self.tilt)
        return (1 + self.share) * np.array([[c, s], [-s, c]])

    @property
    def point(self) -> Array:
        """Return where the point taken for T is, from T at rest, (3,) [m]."""
        return np.array([self.forward, 0.0, self.up])

    def true_angle(self, seen: Array, radius: float) -> Array:
        """Return a rotor's angle about T, (n,) [rad], from that about the point taken for it.

        Args:
            seen: (n,) angle against T, about +y from +x [rad].
            radius: of the rotor's arm [m].
        """
        angle = seen - self.tilt
        across = self.forward * np.sin(angle) + self.up * np.cos(angle)  # of the point to the arm
        return angle - np.arcsin(np.clip(across / radius, -1.0, 1.0))
