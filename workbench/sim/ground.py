"""The thesis' ground law, eq. 3.1 to 3.3 and the stick-slip of section 3.3.2, compiled.

MuJoCo's own soft contact cannot carry this law (its stiffness scales with the effective mass), so
the forces of the foot's four corners are added in the passive-force callback, as machine code that
the engine calls from any of its threads. The callback is global to the process: models without the
numeric field `ground` pass through untouched.

Normal, eq. 3.1 and 3.2:  fz = max(0, -kz z - dz z') for z <= 0, else 0.
Sideways, eq. 3.3:        fy = -ky y - dy y', y from the corner's own line, while it touches.
Forward, fig. 3.4:        unlocked: mu_slide fz against the motion, locks below v_th;
                          locked:   held at an anchor, until the force needed exceeds mu_stick fz;
                          wait:     mu_stick fz, locks again if that suffices, unlocks above v_th.
The anchor is a stiff spring and damper (`Stick`): the only regularisation, it cannot drift.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numba
import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]
from numpy.typing import NDArray

from workbench.sim.structs import as_pointer, check_layout, data_offset, model_offset

__all__ = [
    "CORNERS",
    "CORNER_FIELDS",
    "Stick",
    "add_ground",
    "corner_records",
    "install_ground_law",
]

CORNERS = 4
CORNER_FIELDS = ("state", "anchor_m", "force_x_N", "force_y_N", "force_z_N")
"""What `userdata` keeps for each corner: 0 unlocked, 1 locked, 2 wait; then place and forces."""

UNLOCKED, LOCKED, WAIT = 0.0, 1.0, 2.0

_NAME = "ground"
_MAGIC = 3.1e8  # eq. 3.1; tells our numeric field from anybody else's first one
_WIDTH = len(CORNER_FIELDS)
_PARAMETERS = 13
# 8-byte words into mjModel and mjData
_NUMERIC, _NUMERIC_SIZE = model_offset("numeric_data") // 8, model_offset("nnumericdata") // 8
_QPOS, _QVEL = data_offset("qpos") // 8, data_offset("qvel") // 8
_PASSIVE, _USER = data_offset("qfrc_passive") // 8, data_offset("userdata") // 8
_SPAN = 1 + max(_NUMERIC, _NUMERIC_SIZE, _QPOS, _QVEL, _PASSIVE, _USER)


class Stick(NamedTuple):
    """What holds a locked corner to its anchor: numerics, the thesis' stiction is rigid.

    Both lie well inside what one step can carry for the 0.089 kg that four locked corners see: 0.22
    of m/dt^2 and 0.66 of m/dt.

    Args:
        stiffness: [N/m]; half the breakaway force at rest, 0.16 N, moves the corner by 2 um.
        damping: [N s/m].
    """

    stiffness: float = 8.0e4
    damping: float = 60.0


def add_ground(
    spec: mujoco.MjSpec, values: Mapping[str, float], *, planar: bool, stick: Stick
) -> None:
    """Let the ground carry the foot of a spec whose first body is the foot on a free joint.

    Installs the law, so that no such model can be stepped without it.

    Args:
        spec: robot without other numeric fields; changed in place, as MjSpec's own methods do.
        values: model values by name, SI.
        planar: whether the foot's joints are x, z and pitch instead of a free joint.
        stick: what holds a locked corner.
    """
    install_ground_law()
    data = [
        _MAGIC,
        values["foot_length"] / 2,
        values["foot_width"] / 2,
        values["ground_stiffness"],
        values["ground_damping"],
        values["ground_stiffness_y"],
        values["ground_damping_y"],
        values["friction_slide"],
        values["friction_stick"],
        values["friction_threshold"],
        *stick,
        float(planar),
    ]
    spec.add_numeric(name=_NAME, data=data, size=_PARAMETERS)
    spec.nuserdata = CORNERS * _WIDTH


def corner_records(userdata: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return recorded userdata as (n, 4 corners, 5 fields), fields as in `CORNER_FIELDS`."""
    return userdata.reshape(*userdata.shape[:-1], CORNERS, _WIDTH)


@numba.njit(cache=True)
def _friction(
    p: NDArray[np.float64], corner: NDArray[np.float64], x: float, vx: float, fz: float
) -> float:
    """Return the forward force of one corner and move its state on (thesis, fig. 3.4)."""
    mu_slide, mu_stick, v_th, stiffness, damping = p[7], p[8], p[9], p[10], p[11]
    if fz <= 0.0:
        corner[0] = UNLOCKED
        return 0.0
    if corner[0] == UNLOCKED:
        if abs(vx) >= v_th:
            return -mu_slide * fz * np.sign(vx)
        corner[0] = LOCKED
        corner[1] = x
    held = -stiffness * (x - corner[1]) - damping * vx
    limit = mu_stick * fz
    if abs(held) <= limit:
        corner[0] = LOCKED
        return held
    if corner[0] == WAIT and abs(vx) > v_th:
        corner[0] = UNLOCKED
        return -mu_slide * fz * np.sign(vx)
    corner[0] = WAIT
    return limit * np.sign(held)


@numba.njit(cache=True)
def _foot_forces(
    p: NDArray[np.float64],
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    user: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Add the corners' forces to the foot's free joint: force in the world, torque in the body.

    Written in scalars: an array made here would be an allocation in every step.
    """
    w, x, y, z = q[3], q[4], q[5], q[6]
    xx, xy, xz = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    yx, yy, yz = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    zx, zy, zz = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    spin_x = xx * v[3] + xy * v[4] + xz * v[5]
    spin_y = yx * v[3] + yy * v[4] + yz * v[5]
    spin_z = zx * v[3] + zy * v[4] + zz * v[5]
    for k in range(CORNERS):
        corner = user[k * _WIDTH : (k + 1) * _WIDTH]
        bx = p[1] if k < 2 else -p[1]
        by = p[2] if k % 2 == 0 else -p[2]
        ax, ay, az = xx * bx + xy * by, yx * bx + yy * by, zx * bx + zy * by
        height = q[2] + az
        vx = v[0] + spin_y * az - spin_z * ay
        vy = v[1] + spin_z * ax - spin_x * az
        vz = v[2] + spin_x * ay - spin_y * ax
        fz = max(0.0, -p[3] * height - p[4] * vz) if height <= 0.0 else 0.0  # eq. 3.1, 3.2
        fy = -p[5] * (q[1] + ay - by) - p[6] * vy if height <= 0.0 else 0.0  # eq. 3.3
        fx = _friction(p, corner, q[0] + ax, vx, fz)
        corner[2], corner[3], corner[4] = fx, fy, fz
        tx, ty, tz = ay * fz - az * fy, az * fx - ax * fz, ax * fy - ay * fx
        out[0] += fx
        out[1] += fy
        out[2] += fz
        out[3] += xx * tx + yx * ty + zx * tz
        out[4] += xy * tx + yy * ty + zy * tz
        out[5] += xz * tx + yz * ty + zz * tz


@numba.njit(cache=True)
def _planar_forces(
    p: NDArray[np.float64],
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    user: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Add the corners' forces to the foot's joints x, z and pitch."""
    c, s = np.cos(q[2]), np.sin(q[2])
    for k in range(CORNERS):
        corner = user[k * _WIDTH : (k + 1) * _WIDTH]
        bx = p[1] if k < 2 else -p[1]
        arm_x, arm_z = c * bx, -s * bx
        z, vz = q[1] + arm_z, v[1] - v[2] * arm_x
        fz = max(0.0, -p[3] * z - p[4] * vz) if z <= 0.0 else 0.0  # eq. 3.1, 3.2
        fx = _friction(p, corner, q[0] + arm_x, v[0] + v[2] * arm_z, fz)
        corner[2], corner[3], corner[4] = fx, 0.0, fz
        out[0] += fx
        out[1] += fz
        out[2] += arm_z * fx - arm_x * fz


# Not cached on disk: numba's cache would keep the offsets of an older MuJoCo.
@numba.cfunc("void(voidptr, voidptr)")
def _passive(model, data):  # typed by the signature above
    m = carray(model, _SPAN, dtype=np.int64)
    if m[_NUMERIC_SIZE] < _PARAMETERS:
        return
    p = carray(as_pointer(m[_NUMERIC]), _PARAMETERS, dtype=np.float64)
    if p[0] != _MAGIC:
        return
    d = carray(data, _SPAN, dtype=np.int64)
    q = carray(as_pointer(d[_QPOS]), 7, dtype=np.float64)
    v = carray(as_pointer(d[_QVEL]), 6, dtype=np.float64)
    out = carray(as_pointer(d[_PASSIVE]), 6, dtype=np.float64)
    user = carray(as_pointer(d[_USER]), CORNERS * _WIDTH, dtype=np.float64)
    if p[12]:
        _planar_forces(p, q, v, user, out)
    else:
        _foot_forces(p, q, v, user, out)


def install_ground_law() -> None:
    """Install the law for the whole process; calling it again does no harm.

    Raises:
        RuntimeError: when this MuJoCo build lays its structs out otherwise.
    """
    if not _installed:
        check_layout()
        mujoco.set_mjcb_passive(_passive.ctypes)
        _installed.append(True)


_installed: list[bool] = []
