"""The thesis' ground law, eq. 3.1 to 3.3 and the stick-slip of section 3.3.2, compiled.

MuJoCo's own soft contact cannot carry this law (its stiffness scales with the effective mass), so
the forces of the foot's four corners are added in the passive-force callback (`passive_forces`).

Normal, eq. 3.1 and 3.2:  fz = max(0, -kz z - dz z') for z <= 0, else 0.
Sideways, eq. 3.3:        fy = -ky y - dy y', y from the corner's own line, while it touches.
Forward, fig. 3.4:        unlocked: mu_slide fz against the motion, locks below v_th;
                          locked:   held at an anchor, until the force needed exceeds mu_stick fz;
                          wait:     mu_stick fz; locks again if that suffices, is loose as soon as
                                    the corner moves faster than a step ago;
                          loose:    mu_slide fz, unlocks above v_th, locks when it turns back.
Static friction does not brake what moves: the thesis' Joint Stiction Actuator compares it with the
load and moves the joint against kinetic friction alone (decision 2).
The anchor is a stiff spring and damper (`Stick`): the only regularisation, it cannot drift. It
locks where its damper's force has come down to the sliding one, and is dragged along while loose.

A corner lands, locks, breaks loose and turns back within a step, not at its end. A step in which it
lands has the share of the force for which it touches; one after a change of state, or of direction,
compensates the part of the step before the change. Without it a slightly greater stiffness moves a
change from one step to another: T jumped by up to 0.2 mm after 4 s of hopping, and a hop had no
usable derivative.

Beyond the thesis, each absent where it is zero (`ExtraTerm`): damping that grows with depth, as in
Hunt and Crossley's law; a sole that sticks, its spring pulling back until it tears off; friction
that depends on the direction; static friction that also brakes a loose corner.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

import mujoco
import numba
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CORNERS",
    "CORNER_FIELDS",
    "GROUND_MAGIC",
    "GROUND_PARAMETERS",
    "GROUND_RECORD",
    "ExtraTerm",
    "Stick",
    "add_ground",
    "corner_records",
    "extend_ground",
    "foot_forces",
    "planar_forces",
    "planar_forces_again",
]

Array = NDArray[np.float64]

CORNERS = 4
CORNER_FIELDS = (
    "state", "anchor_m", "force_x_N", "force_y_N", "force_z_N", "touching", "speed_x_m_s",
)  # fmt: skip
"""State of each corner in `userdata`: 0 unlocked, 1 locked, 2 wait, 3 loose; anchor and forces; 1
while in contact; its forward speed a step ago where it touched."""

UNLOCKED, LOCKED, WAIT, LOOSE = 0.0, 1.0, 2.0, 3.0

_NAME = "ground"
_WIDTH = len(CORNER_FIELDS)

GROUND_MAGIC = 3.1e8  # eq. 3.1
"""First number of the numeric field, by which it is recognized."""
GROUND_PARAMETERS = 18
"""How many numbers the numeric field has."""
GROUND_RECORD = CORNERS * _WIDTH
"""How many numbers of `userdata` the law keeps."""

ExtraTerm = Literal["depth_damping", "adhesion", "anisotropy", "wait"]
"""Terms that the thesis' law does not have: lambda of a corner's damping lambda |z| [N s/m^2]; the
greatest pull of a corner [N]; the share by which friction is greater against a forward motion and
smaller against a backward one [1]; the share of what static friction has beyond sliding friction
that brakes a loose corner [1]."""

_EXTRA_TERMS: dict[ExtraTerm, int] = {
    "depth_damping": 13,
    "adhesion": 14,
    "anisotropy": 15,
    "wait": 16,
}


class Stick(NamedTuple):
    """Spring and damper of a locked corner's anchor: numerics, the thesis' stiction is rigid.

    Both are well below the stability limits of a step for the 0.089 kg on four locked corners: 0.22
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

    Args:
        spec: robot without numeric fields, its step set; changed in place, as MjSpec's own methods
            do.
        values: model values by name, SI.
        planar: whether the foot's joints are x, z and pitch instead of a free joint.
        stick: anchor of a locked corner.
    """
    data = [
        GROUND_MAGIC,
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
        *[0.0] * len(_EXTRA_TERMS),
        spec.option.timestep,
    ]
    spec.add_numeric(name=_NAME, data=data, size=GROUND_PARAMETERS)
    spec.nuserdata = GROUND_RECORD


def extend_ground(spec: mujoco.MjSpec, name: ExtraTerm, by: float) -> None:
    """Add to an extra term of the ground law; do nothing without a ground.

    Args:
        spec: changed in place.
        name: of the term.
        by: added to it, in its unit.
    """
    ground = spec.numeric(_NAME)
    if ground is not None:
        ground.data[_EXTRA_TERMS[name]] += by


def corner_records(userdata: Array) -> Array:
    """Return recorded userdata by corner, (..., 4, 7) [units of `CORNER_FIELDS`].

    Args:
        userdata: (..., 28) as recorded [units of `CORNER_FIELDS`].
    """
    return userdata.reshape(*userdata.shape[:-1], CORNERS, _WIDTH)


@numba.njit(cache=True)
def _normal(p: Array, corner: Array, z: float, vz: float) -> float:
    """Return the upward force of one corner at a height (thesis, eq. 3.1 and 3.2)."""
    touching, stiffness, damping, step = corner[5], p[3], p[4], p[17]
    if z <= 0.0:
        corner[5] = 1.0
    elif touching == 0.0 and z + vz * step < 0.0:  # lands within this step
        return -(1 + z / (vz * step)) * damping * vz
    elif touching == 0.0 or stiffness * z >= p[14]:
        corner[5] = 0.0
        return 0.0
    return max(0.0 - p[14], -stiffness * z - (damping - p[13] * min(z, 0.0)) * vz)


@numba.njit(cache=True)
def _friction(p: Array, corner: Array, x: float, vx: float, fz: float) -> float:
    """Return the forward force of one corner and update its state (thesis, fig. 3.4)."""
    v_th, stiffness, damping, step = p[9], p[10], p[11], p[17]
    v_before = corner[6]
    speed, before = abs(vx), abs(v_before)
    corner[6] = vx if fz > 0.0 else 0.0  # zero where it did not touch
    if fz <= 0.0:
        corner[0] = UNLOCKED
        return 0.0
    way = np.sign(vx)
    kinetic = p[7] * (1 + p[15] * way) * fz
    sliding = -way * kinetic
    late = 0.0  # share of a step for which it is locked already
    if corner[0] == UNLOCKED:
        locks = min(v_th, kinetic / damping)  # there the anchor's force is the sliding one
        if speed >= locks:
            if vx * v_before < 0.0:  # it has turned back, and was pushed the wrong way since
                late = speed / (speed + before)
                sliding -= 2 * late * way * p[7] * (1 - p[15] * way) * corner[4]
            return sliding
        if before > locks:
            late = (locks - speed) / (before - speed)
        corner[0] = LOCKED
        corner[1] = x - vx * late * step
    elif corner[0] == LOOSE:
        way = np.sign(x - corner[1])  # direction of its load
        if vx * way < 0.0:
            corner[0] = LOCKED
        else:
            slow = -way * (p[7] + p[16] * (p[8] - p[7])) * (1 + p[15] * way) * fz
            if speed > v_th:
                corner[0] = UNLOCKED
                late = (speed - v_th) / (speed - before) if before < v_th else 0.0
                return sliding + late * (sliding - slow)
            corner[1] = x + slow / stiffness
            return slow
    held = -stiffness * (x - corner[1]) - damping * vx
    way = -np.sign(held)
    limit = p[8] * (1 + p[15] * way) * fz
    if abs(held) <= limit:
        corner[0] = LOCKED
        return held + late * (held - sliding)
    if corner[0] == WAIT and vx * way > max(v_before * way, 0.0):
        slow = -way * (p[7] + p[16] * (p[8] - p[7])) * (1 + p[15] * way) * fz
        corner[0] = LOOSE
        corner[1] = x + slow / stiffness
        return slow + (slow + way * limit)  # it has been for a step
    corner[0] = WAIT
    return -way * limit


@numba.njit(cache=True)
def foot_forces(p: Array, q: Array, v: Array, user: Array, out: Array) -> None:
    """Add the corners' forces to the foot's free joint: force in the world, torque in the body.

    Written in scalars: an array made here would be an allocation in every step.

    Args:
        p: (18,) numeric field [SI].
        q: (nq,) qpos, of which the first 7 are the foot's [m, 1, rad].
        v: (nv,) qvel, of which the first 6 are the foot's [m/s, rad/s].
        user: (28,) corners, updated [units of `CORNER_FIELDS`].
        out: (nv,) forces, added to [N, N m].
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
        fz = _normal(p, corner, height, vz)
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
def planar_forces_again(p: Array, q: Array, user: Array, out: Array) -> None:
    """Add the forces that `user` has of the same state, without a second update of its corners.

    Args:
        p: (18,) numeric field [SI].
        q: (n,) coordinates, of which the first 3 are the foot's [m, rad].
        user: (28,) corners [units of `CORNER_FIELDS`].
        out: (n,) forces, of which the first 3 are added to [N, N m].
    """
    c, s = np.cos(q[2]), np.sin(q[2])
    for k in range(CORNERS):
        fx, fz = user[k * _WIDTH + 2], user[k * _WIDTH + 4]
        bx = p[1] if k < 2 else -p[1]
        out[0] += fx
        out[1] += fz
        out[2] += -s * bx * fx - c * bx * fz


@numba.njit(cache=True)
def planar_forces(p: Array, q: Array, v: Array, user: Array, out: Array) -> None:
    """Add the corners' forces to the foot's joints x, z and pitch.

    Args:
        p: (18,) numeric field [SI].
        q: (n,) coordinates, of which the first 3 are the foot's [m, rad].
        v: (n,) their rates [m/s, rad/s].
        user: (28,) corners, updated [units of `CORNER_FIELDS`].
        out: (n,) forces, of which the first 3 are added to [N, N m].
    """
    c, s = np.cos(q[2]), np.sin(q[2])
    for edge in range(2):  # its two corners move alike
        first = 2 * edge * _WIDTH
        corner = user[first : first + _WIDTH]
        bx = p[1] if edge == 0 else -p[1]
        arm_x, arm_z = c * bx, -s * bx
        z, vz = q[1] + arm_z, v[1] - v[2] * arm_x
        fz = _normal(p, corner, z, vz)
        fx = _friction(p, corner, q[0] + arm_x, v[0] + v[2] * arm_z, fz)
        corner[2], corner[3], corner[4] = fx, 0.0, fz
        for i in range(_WIDTH):
            user[first + _WIDTH + i] = corner[i]
    planar_forces_again(p, q, user, out)
