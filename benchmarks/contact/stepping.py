"""The ground law by Moreau and Jean's time-stepping: impulses within a step, no states, no events.

    M (v1 - v0) = h f + H_n p_n + H_t p_t,   q1 = q0 + h (v0 + v1) / 2

f at the middle of the step, linear in v1 for springs, dampers and servo (theta = 1/2). Eq. 3.1 is a
complementarity of the impulse and the compression that the new velocity leaves, friction a normal
cone: p_t in -mu p_n Sign(u_t), u_t the new forward velocity of an edge. mu is that of sticking for
an edge that ends the step slower than the threshold, if asked for, else that of sliding; an edge at
rest is held by up to that of sticking. The choice of open or pushing, resting or sliding of the two
edges is found by trying all of them.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.contact.chain import Chain, factor, forces, mass_matrix, solve

__all__ = ["march"]

Array = NDArray[np.float64]

EDGES = 2
_TOLERANCE = 1e-12
_OPEN = 3
_WAYS = (0, 1, -1, _OPEN)
"""What an edge may do in a step: rest, slide forward, slide backward, not touch."""


@numba.njit(cache=True)
def _stiffness(c: Chain, h: float, m: Array) -> None:
    """Add h/2 D + h^2/4 K of the beam's springs and of the servo to the mass matrix."""
    n = len(c.first)
    for k in range(n - 1):
        if k < n - 2:
            add = 0.5 * h * c.damping[k] + 0.25 * h * h * c.stiffness[k]
        else:
            add = 0.5 * h * c.servo[1] + 0.25 * h * h * c.servo[0]
        i, j = 2 + k, 3 + k
        m[i, i] += add
        m[j, j] += add
        m[i, j] -= add
        m[j, i] -= add


@numba.njit(cache=True)
def _impulses(
    c: Chain, still: bool, h: float, gap: Array, push: Array, u: Array, g: Array, p: Array
) -> None:
    """Write the impulses p (4,): upward and forward of the first edge, then of the second.

    Args:
        c: the robot.
        still: whether static friction acts up to the threshold speed.
        h: step [s].
        gap: (2,) heights at the middle of the step, less the part that the new velocity adds [m].
        push: (2,) 1 where an edge is below the floor.
        u: (4,) velocities without impulses [m/s].
        g: (4, 4) what a unit impulse adds to them.
        p: (4,) written.
    """
    slide, stick, v_th = c.friction
    k, d = c.normal
    # p_n = -h (k (gap + h/4 u) + d (u + old) / 2): 'gap' holds the old velocity's part
    soft = h * (0.25 * h * k + 0.5 * d)
    a, rhs = np.zeros((4, 4)), np.zeros(4)
    for first in _WAYS:
        for second in _WAYS:
            for level in range(4 if still else 1):
                a[:] = 0.0
                rhs[:] = 0.0
                possible = True
                for e in range(EDGES):
                    way = first if e == 0 else second
                    i, j = 2 * e, 2 * e + 1
                    if way == _OPEN:
                        a[i, i] = a[j, j] = 1.0
                        continue
                    if push[e] == 0.0:
                        possible = False
                        break
                    a[i] = soft * g[i]
                    a[i, i] += 1.0
                    rhs[i] = -h * gap[e] - soft * u[i]
                    if way == 0:
                        a[j] = g[j]
                        rhs[j] = -u[j]
                    else:
                        slow = (level >> e) & 1
                        a[j, j] = 1.0
                        a[j, i] = way * (stick if slow else slide)
                if not possible:
                    continue
                if first == 0 and second == 0:  # equal edges: the same share for both
                    twist = g[1, 1] * g[3, 3] - g[1, 3] * g[3, 1]
                    if twist < 1e-12 * g[1, 1] * g[3, 3]:
                        a[1] = 0.5 * (g[1] + g[3])
                        rhs[1] = -0.5 * (u[1] + u[3])
                        a[3] = 0.0
                        a[3, 1], a[3, 3] = 1.0, -1.0
                        rhs[3] = 0.0
                found = np.linalg.solve(a, rhs)
                fine = True
                for e in range(EDGES):
                    way = first if e == 0 else second
                    i, j = 2 * e, 2 * e + 1
                    up, along = u[i], u[j]
                    for b in range(4):
                        up += g[i, b] * found[b]
                        along += g[j, b] * found[b]
                    if way == _OPEN:
                        fine &= push[e] == 0.0 or h * gap[e] + soft * up >= -_TOLERANCE * h
                        continue
                    fine &= found[i] >= -_TOLERANCE * h
                    if way == 0:
                        fine &= abs(found[j]) <= stick * found[i] + _TOLERANCE * h
                    else:
                        slow = (level >> e) & 1
                        fine &= way * along >= -_TOLERANCE
                        if still:
                            fine &= (abs(along) <= v_th) if slow else (abs(along) >= v_th)
                if fine:
                    p[:] = found
                    return
    # mu jumps at the threshold: where no choice is consistent the edge ends the step on the jump,
    # and the last forces are kept within their new normal impulses
    for e in range(EDGES):
        i, j = 2 * e, 2 * e + 1
        p[j] = min(max(p[j], -stick * p[i]), stick * p[i])


@numba.njit(cache=True)
def march(
    c: Chain, still: bool, q: Array, v: Array, drive: Array, samples: int, every: int, h: float
) -> Array:
    """Return the foot's x, z and pitch at samples, (n, 3).

    Args:
        c: the robot.
        still: whether static friction acts up to the threshold speed, else at rest only.
        q: coordinates at time zero.
        v: their rates.
        drive: commanded angle of the rotor at time zero [rad] and speed [rad/s].
        samples: how many, the first at time zero.
        every: steps from one sample to the next.
        h: step [s].
    """
    n = len(q)
    q, v = q.copy(), v.copy()
    kept = np.zeros((samples, 3))
    m, f, middle = np.zeros((n, n)), np.zeros(n), q.copy()
    rows, w, g = np.zeros((4, n)), np.zeros((4, n)), np.zeros((4, 4))
    u, p, gap, push, old = np.zeros(4), np.zeros(4), np.zeros(2), np.zeros(2), np.zeros(4)
    for s in range(samples):
        kept[s] = q[:3]
        if s == samples - 1:
            break
        for i in range(every):
            t = (s * every + i) * h
            # springs at q0 + h/2 v0: what v1 - v0 adds, h/4 of it, is in the matrix
            middle[:] = q + 0.5 * h * v
            mass_matrix(c, middle, m)
            forces(c, middle, v, drive[0] + drive[1] * (t + 0.5 * h), drive[1], f)
            _stiffness(c, h, m)
            factor(m)
            for e in range(EDGES):
                b = c.half if e == 0 else -c.half
                ax, az = np.cos(middle[2]) * b, -np.sin(middle[2]) * b
                rows[2 * e, :], rows[2 * e + 1, :] = 0.0, 0.0
                rows[2 * e, 1], rows[2 * e, 2] = 1.0, -ax
                rows[2 * e + 1, 0], rows[2 * e + 1, 2] = 1.0, az
                z = middle[1] + az
                up = v[1] - ax * v[2]
                push[e] = 1.0 if z <= 0.0 else 0.0
                gap[e] = c.normal[0] * (z - 0.25 * h * up) + 0.5 * c.normal[1] * up
            f *= h
            solve(m, f)
            for a in range(4):
                w[a] = rows[a]
                solve(m, w[a])
            for a in range(4):
                old[a] = u[a] = 0.0
                for k in range(n):
                    u[a] += rows[a, k] * (v[k] + f[k])
                for b in range(4):
                    g[a, b] = 0.0
                    for k in range(n):
                        g[a, b] += rows[a, k] * w[b, k]
            _impulses(c, still, h, gap, push, u, g, p)
            for k in range(n):
                change = f[k]
                for a in range(4):
                    change += w[a, k] * p[a]
                q[k] += h * (v[k] + 0.5 * change)
                v[k] += change
    return kept
