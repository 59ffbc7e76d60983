"""What is drawn of one instant: robot as seen and estimated, twin as predicted, missing force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.fit import Estimate, PointForces
from workbench.motion import FOOT, PITCH, ROTOR, TOP
from workbench.sim import Robot, hinge_name

__all__ = ["PoseDrawing"]

Array = NDArray[np.float64]
Point = list[float]


class PoseDrawing:
    """Draws poses of a model, from where its foot rests.

    Args:
        model: that is observed.
        robot: it was made of.
    """

    def __init__(self, model: mujoco.MjModel, robot: Robot) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._chain = [
            model.joint(hinge_name(k)).id
            for k, hinge in enumerate(robot.hinges)
            if hinge.stiffness is not None
        ]
        self._bodies = [model.body(name).id for name in ("foot", "top")]
        self._rotor, self._free = model.site("rotor").id, model.nq > 1 + len(self._chain)
        mujoco.mj_kinematics(model, self._data)
        self._origin: Array | None = None

    def of(
        self, seen: Mapping[str, float], estimate: Estimate, missing: PointForces | None
    ) -> dict[str, Any]:
        """Return what is drawn, in JSON's terms; places [m] from the foot's rest, forces [N]."""
        robot = self._pose(estimate.qpos)
        for name, point in (("foot", FOOT), ("top", TOP), ("rotor", ROTOR)):
            at = [seen[axis] for axis in point]
            robot[name] = at if np.isfinite(at).all() else None
        pitch = seen.get(PITCH, np.nan)
        robot["pitch"] = pitch if np.isfinite(pitch) else robot["pitch"]
        twin = None if estimate.predicted is None else self._pose(estimate.predicted)
        forces = None
        if missing is not None:
            forces = {
                name: [force[0], 0.0, force[1]]
                for name, force in missing.force.items()
                if np.hypot(*force) > 2 * np.hypot(*missing.sigma[name])
            }
        return {"robot": robot, "twin": twin, "missing": forces}

    def _pose(self, qpos: Array) -> dict[str, Any]:
        data = self._data
        data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, data)
        foot, top = data.xpos[self._bodies]
        if self._origin is None:
            self._origin = foot.copy()
        beam = np.vstack([data.xanchor[self._chain], top]) - self._origin
        return {
            "foot": (foot - self._origin).tolist(),
            "top": (top - self._origin).tolist(),
            "rotor": (data.site_xpos[self._rotor] - self._origin).tolist(),
            "pitch": float(qpos[2]) if self._free else 0.0,
            "beam": beam.tolist(),
        }
