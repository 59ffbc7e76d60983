"""Which shapes can be bent from a strip and stand: asked before anything is simulated.

The shapes of the thesis' figure 5.2 hop well in a simulation that lets the strip pass through
itself; the sum of the angles alone does not keep them out.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.errors import InputError
from workbench.shape import bend_radii, clearance, curve

__all__ = ["LEAST_RADIUS_M", "BendableStrip", "beam_points"]

LEAST_RADIUS_M = 0.03
"""Bend radius at which bending by hand over an edge begins; 0.6 rad at a joint is 64 mm."""


@dataclass(frozen=True)
class BendableStrip:
    """What can be made of a strip, and what can stand on its foot.

    Args:
        length: of the beam [m].
        thickness: of the strip [m]; 0 where it is not known takes the centreline alone.
        least_radius: the tightest bend that is allowed [m].
    """

    length: float
    thickness: float = 0.0
    least_radius: float = LEAST_RADIUS_M

    def require_bendable(self, angles: ArrayLike) -> None:
        """Refuse angles that no strip can be bent to.

        Args:
            angles: (16,) alpha_0 to alpha_15 [rad].

        Raises:
            InputError: with the joint, its radius and what is allowed.
        """
        radii = bend_radii(angles, self.length)
        tightest = int(np.argmin(radii))
        if radii[tightest] < self.least_radius:
            raise InputError(
                f"this shape cannot be bent: its radius at joint {tightest + 1} is "
                f"{1e3 * radii[tightest]:.1f} mm, at least {1e3 * self.least_radius:g} mm are "
                "needed; lessen that angle"
            )
        self._require_apart(curve(angles, self.length), "bent")

    def require_upright(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Refuse a robot at rest whose strip crosses itself or the floor, or whose T overhangs.

        Args:
            model: of the robot.
            data: at rest under gravity.

        Raises:
            InputError: with the place and what is allowed.
        """
        points = beam_points(model, data)
        foot = data.body("foot").xpos
        self._require_apart(points, "at rest")
        lowest = float(points[1:, 1].min() - foot[2])
        if lowest <= self.thickness / 2:
            raise InputError(
                f"this shape cannot hop: at rest its strip reaches {1e3 * lowest:.0f} mm from the "
                "foot's plane; it must stay above it"
            )
        half = float(model.geom_size[model.body("foot").geomadr[0], 0])
        overhang = abs(float(points[-1, 0] - foot[0])) - half
        if overhang > 0:
            raise InputError(
                f"this shape cannot hop: at rest T is {1e3 * overhang:.0f} mm off the foot's "
                f"edge; it must be above the foot, within {1e3 * half:g} mm of "
                "its centre"
            )

    def _require_apart(self, points: NDArray[np.float64], when: str) -> None:
        gap = clearance(points)
        if gap > self.thickness:
            return
        if gap == 0:
            raise InputError(f"this shape cannot be bent: {when}, its strip crosses itself")
        raise InputError(
            f"this shape cannot be bent: {when}, parts of its strip come within "
            f"{1e3 * gap:.1f} mm and the strip is {1e3 * self.thickness:g} mm thick"
        )


def beam_points(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the ends of the increments from the root to T, (N + 1, 2) as x, z [m]."""
    names = (model.body(k).name for k in range(model.nbody))
    chain = [*(name for name in names if name.startswith("increment_")), "top"]
    return np.array([data.body(name).xpos[[0, 2]] for name in chain])
