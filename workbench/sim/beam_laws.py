"""Forces on beam and T that MuJoCo has no field for, compiled: play, drag, a cable's pull.

They are added in the passive-force callback (`passive_forces`) to models with the numeric field
`laws`. Each is absent where its numbers are zero.

Root:  torque = -k dead(a), a from the rest angle of the foot joint; dead(a) is zero within the gap
       and a less the gap beyond. The joint's own spring gives -k a, k clip(a, -gap, gap) is added.
T:     force = -c |v| v  +  (pull - k (x - x0)) forward.
"""

from __future__ import annotations

from typing import Literal

import mujoco
import numba
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "LAWS_MAGIC",
    "LAWS_PARAMETERS",
    "Law",
    "add_law",
    "leave_edge",
    "play_torque",
    "top_force",
    "top_forces",
    "within_play",
]

Array = NDArray[np.float64]

LAWS_MAGIC = 3.4e8  # fig. 3.4 has none of these
"""First number of the numeric field, by which it is recognized."""
LAWS_PARAMETERS = 10
"""How many numbers the numeric field has."""

Law = Literal["root_gap", "top_drag", "top_pull", "top_stiffness", "top_x"]
"""Half the play of the foot joint [rad]; c at T [N s^2/m^2], pull on T [N], k on T [N/m] and its
rest position forward [m]."""

_NAME = "laws"
_INDEX: dict[Law, int] = {
    "root_gap": 5,
    "top_drag": 6,
    "top_pull": 7,
    "top_stiffness": 8,
    "top_x": 9,
}
_FOOT = 1  # the body at whose subtree's centre of mass the engine takes its motion axes


def add_law(spec: mujoco.MjSpec, numbers: dict[Law, float]) -> None:
    """Set numbers of the laws; the others keep what they were, zero at first.

    Args:
        spec: of a robot with all its bodies; changed in place.
        numbers: by name, SI.
    """
    field = spec.numeric(_NAME)
    if field is None:
        data = [LAWS_MAGIC, *_addresses(spec), *[0.0] * len(_INDEX)]
        field = spec.add_numeric(name=_NAME, data=data, size=LAWS_PARAMETERS)
    for name, number in numbers.items():
        field.data[_INDEX[name]] = number


def within_play(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Return whether the foot joint is in its play, where no spring holds the robot up."""
    return _beyond(model, data)[1] < 0


def leave_edge(model: mujoco.MjModel, data: mujoco.MjData, by: float, within: bool = False) -> None:
    """Turn a foot joint that is at the edge of its play outwards, where its spring holds it.

    Args:
        model: of the robot.
        data: whose pose may change.
        by: how close to the edge it may be left [rad].
        within: turn it inwards, where no spring does.
    """
    joint, beyond = _beyond(model, data)
    if abs(beyond) < by:
        outwards = np.sign(data.qpos[joint] - model.qpos_spring[joint])
        data.qpos[joint] += outwards * ((-by if within else by) - beyond)


def _beyond(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[int, float]:
    """Return the foot joint's address in qpos, and how far it is beyond its play [rad]."""
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, _NAME) < 0:
        return 0, np.inf
    numbers = model.numeric(_NAME).data
    joint, gap = int(numbers[2]), float(numbers[_INDEX["root_gap"]])
    turned = float(data.qpos[joint] - model.qpos_spring[joint])
    return joint, abs(turned) - gap if gap else np.inf


def _addresses(spec: mujoco.MjSpec) -> tuple[int, int, int, int]:
    """Return the index of the foot joint, its addresses in qpos and qvel, and the index of T."""
    joints = spec.body("foot").joints
    free = any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in joints)
    qpos, dof = (7, 6) if free else (len(joints), len(joints))
    return len(joints), qpos, dof, [body.name for body in spec.bodies].index("top")


@numba.njit(cache=True)
def play_torque(p: Array, q: Array, stiffness: Array, rest: Array, out: Array) -> None:
    """Cancel the torque of the foot joint's spring within the play.

    Args:
        p: (10,) numbers of the laws, as in the numeric field [SI].
        q: (nq,) qpos [m, rad].
        stiffness: (njnt,) jnt_stiffness [N m/rad].
        rest: (nq,) qpos_spring [m, rad].
        out: (nv,) qfrc_passive [N, N m].
    """
    joint, i, dof, gap = int(p[1]), int(p[2]), int(p[3]), p[5]
    out[dof] += stiffness[joint] * min(max(q[i] - rest[i], -gap), gap)


@numba.njit(cache=True)
def top_force(p: Array, x: float, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """Return drag and pull at T [N].

    Args:
        p: (10,) numbers of the laws, as in the numeric field [SI].
        x: position of T, forward [m].
        vx: velocity of T forward [m/s].
        vy: to the left [m/s].
        vz: upward [m/s].
    """
    drag = -p[6] * np.sqrt(vx * vx + vy * vy + vz * vz)
    return drag * vx + p[7] - p[8] * (x - p[9]), drag * vy, drag * vz


@numba.njit(cache=True)
def top_forces(
    p: Array, positions: Array, centres: Array, axes: Array, speeds: Array, out: Array
) -> None:
    """Add drag and pull at T to the forces of the degrees of freedom.

    Written in scalars: an array made here would be an allocation in every step.

    Args:
        p: (10,) numbers of the laws, as in the numeric field [SI].
        positions: (nbody, 3) xpos, of the bodies [m].
        centres: (nbody, 3) subtree_com [m].
        axes: (nv, 6) cdof, turning and moving of each degree of freedom about the centre [rad, m by
            unit of qpos].
        speeds: (nbody, 6) cvel, of the bodies about the same centre [rad/s], [m/s].
        out: (nv,) qfrc_passive [N, N m]; its last entry is the rotor's, with which T does not turn.
    """
    at, turn, centre = positions[int(p[4])], speeds[int(p[4])], centres[_FOOT]
    x, y, z = at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]
    vx = turn[3] + turn[1] * z - turn[2] * y
    vy = turn[4] + turn[2] * x - turn[0] * z
    vz = turn[5] + turn[0] * y - turn[1] * x
    fx, fy, fz = top_force(p, at[0], vx, vy, vz)
    tx, ty, tz = y * fz - z * fy, z * fx - x * fz, x * fy - y * fx
    for k in range(out.shape[0] - 1):
        axis = axes[k]
        out[k] += axis[0] * tx + axis[1] * ty + axis[2] * tz
        out[k] += axis[3] * fx + axis[4] * fy + axis[5] * fz
