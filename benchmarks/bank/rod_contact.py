"""The ground under the foot: its own law, with states that only events change.

Normal, a point that stands for `corners` of the thesis' corners, depth = -z, while attached:
    f = corners (k depth - d z' min(1, depth / ramp) - lambda depth z'), at least -adhesion
Damping grows in over the first half millimetre, so that a landing has no jump of force: the
thesis' eq. 3.1 has one. An attached point lets go above adhesion / k.
Forward: held by a spring and damper of the sole until its force exceeds mu_stick f; then mu_slide f
against the sliding until that ends. There is no threshold speed, unlike in the thesis' fig. 3.4.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.bank.rod_constants import Constants

__all__ = [
    "ANCHOR",
    "ATTACHED",
    "CORNERS",
    "POINT_X",
    "POINT_Z",
    "SLIDES",
    "STATES",
    "event",
    "ground_forces",
    "mark",
    "switch",
]

Array = NDArray[np.float64]

POINT_X, POINT_Z, CORNERS, ATTACHED, SLIDES, ANCHOR = 0, 1, 2, 3, 4, 5
STATES = 6
"""Columns of the table of contact points: place on the foot [m], how many corners it stands for;
whether it touches, the sign of its sliding (0 holds), where it holds [m]."""

SOLE_STIFFNESS = 1.0e4
SOLE_DAMPING = 10.0
"""[N/m], [N s/m] of a corner that holds."""
_RAMP_M = 5e-4
_LIFTED_M = 1e-8
_BACK_M_S = 2e-3  # a point that slides the wrong way as fast as this holds again


@numba.njit(cache=True)
def _motion(p: Array, x: Array, v: Array) -> tuple[float, float, float, float]:
    """Return place and velocity of a contact point, from the foot's coordinates and rates."""
    c, s = np.cos(x[2]), np.sin(x[2])
    ax, az = c * p[POINT_X] + s * p[POINT_Z], c * p[POINT_Z] - s * p[POINT_X]
    return x[0] + ax, x[1] + az, v[0] + v[2] * az, v[1] - v[2] * ax


@numba.njit(cache=True)
def _normal(p: Array, k: Constants, z: float, vz: float) -> float:
    if p[ATTACHED] == 0.0:
        return 0.0
    depth = -z
    force = k.ground_stiffness * depth
    if depth > 0.0:
        force -= k.ground_damping * vz * min(1.0, depth / _RAMP_M) + k.hunt_crossley * depth * vz
    return p[CORNERS] * max(force, -k.adhesion)


@numba.njit(cache=True)
def _held(p: Array, x: float, vx: float) -> float:
    return -p[CORNERS] * (SOLE_STIFFNESS * (x - p[ANCHOR]) + SOLE_DAMPING * vx)


@numba.njit(cache=True)
def _sliding(k: Constants, sign: float, normal: float) -> float:
    return -sign * k.friction_slide * (1 + k.anisotropy * sign) * max(normal, 0.0)


@numba.njit(cache=True)
def ground_forces(points: Array, k: Constants, x: Array, v: Array, out: Array) -> None:
    """Write the force on the foot's x, z and pitch, (3,), of contact points (c, 6)."""
    out[:] = 0.0
    for i in range(len(points)):
        p = points[i]
        if p[ATTACHED] == 0.0:
            continue
        px, pz, vx, vz = _motion(p, x, v)
        normal = _normal(p, k, pz, vz)
        along = _held(p, px, vx) if p[SLIDES] == 0.0 else _sliding(k, p[SLIDES], normal)
        out[0] += along
        out[1] += normal
        out[2] += (pz - x[1]) * along - (px - x[0]) * normal


@numba.njit(cache=True)
def event(p: Array, k: Constants, x: Array, v: Array, slid: float) -> float:
    """Return a number above zero where a point's state has to change.

    Args:
        p: (6,) the point.
        k: the robot.
        x: (3,) foot's coordinates.
        v: (3,) their rates.
        slid: 1 where the point has slid its own way since it broke loose.
    """
    px, pz, vx, vz = _motion(p, x, v)
    if p[ATTACHED] == 0.0:
        return -pz
    lifted = pz - k.adhesion / k.ground_stiffness
    if lifted > 0.0:
        return lifted
    if p[SLIDES] == 0.0:
        sign = -np.sign(_held(p, px, vx))
        grip = k.friction_stick * (1 + k.anisotropy * sign) * max(_normal(p, k, pz, vz), 0.0)
        return abs(_held(p, px, vx)) - grip
    wrong = -p[SLIDES] * vx
    return wrong if slid > 0.0 else wrong - _BACK_M_S


@numba.njit(cache=True)
def mark(points: Array, k: Constants, x: Array, v: Array, slid: Array) -> None:
    """Note which points slide their own way."""
    for i in range(len(points)):
        vx = _motion(points[i], x, v)[2]
        if points[i, SLIDES] * vx > 0.0:
            slid[i] = 1.0


@numba.njit(cache=True)
def switch(p: Array, k: Constants, x: Array, v: Array) -> None:
    """Change the state of a point whose event has come."""
    px, pz, vx, vz = _motion(p, x, v)
    if p[ATTACHED] == 0.0:
        p[ATTACHED] = 1.0
        p[SLIDES] = 1.0 if vx >= 0.0 else -1.0
    elif pz - k.adhesion / k.ground_stiffness > -_LIFTED_M:
        p[ATTACHED] = 0.0
        p[SLIDES] = 0.0
    elif p[SLIDES] == 0.0:
        p[SLIDES] = -1.0 if _held(p, px, vx) > 0.0 else 1.0
    else:  # holds with the force that it slid with
        along = _sliding(k, p[SLIDES], _normal(p, k, pz, vz))
        p[ANCHOR] = px + (along / p[CORNERS] + SOLE_DAMPING * vx) / SOLE_STIFFNESS
        p[SLIDES] = 0.0
