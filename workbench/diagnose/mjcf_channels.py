"""What the channels of a rig show of a motion of its model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.mjcf_names import index_of
from workbench.protocol import RigFile

__all__ = ["Source", "channels_of", "shown"]

_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Source:
    """Where the engine has a channel.

    Args:
        array: of the engine's data.
        index: in that array; of a site the row, and then `axis` is the column.
        axis: of a site.
        unit: SI.
    """

    array: Literal["qpos", "qvel", "site_xpos"]
    index: int
    axis: int
    unit: str


def channels_of(content: RigFile, model: mujoco.MjModel) -> Iterator[Source]:
    """Yield where the channels of a rig file are, in their order; its names have been checked."""
    for channel in content.channels.values():
        if channel.joint is None:
            site = index_of(model, "site", str(channel.site))
            yield Source("site_xpos", site, _AXES.index(str(channel.axis)), "m")
            continue
        joint = index_of(model, "joint", channel.joint)
        unit = "rad" if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE else "m"
        if channel.quantity == "position":
            yield Source("qpos", int(model.jnt_qposadr[joint]), 0, unit)
        else:
            yield Source("qvel", int(model.jnt_dofadr[joint]), 0, f"{unit}/s")


def shown(
    sources: Sequence[Source],
    model: mujoco.MjModel,
    qpos: NDArray[np.float64],
    qvel: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the channels, (m, c), of a motion.

    Sites are found anew from the joints: what the engine keeps of them while it steps belongs to
    the state before the step or, with RK4, to none.

    Args:
        sources: of the channels.
        model: whose motion it is.
        qpos: (m, nq).
        qvel: (m, nv).
    """
    sites = np.empty((len(qpos), model.nsite, 3))
    if any(source.array == "site_xpos" for source in sources):
        data = mujoco.MjData(model)
        for k, place in enumerate(qpos):
            data.qpos[:] = place
            mujoco.mj_kinematics(model, data)
            sites[k] = data.site_xpos
    arrays = {"qpos": qpos, "qvel": qvel}
    return np.column_stack(
        [
            sites[:, source.index, source.axis]
            if source.array == "site_xpos"
            else arrays[source.array][:, source.index]
            for source in sources
        ]
    )
