"""Steps of planar chains, compiled: the engine's `implicitfast`, by articulated bodies.

A step solves (M + h D) a = f for the acceleration a of the hinges' angles and moves on by

    v <- v + h a,    q <- q + h v,

with M the inertia, D the derivative of dampers and motors by the speeds, f all forces at the state
before it. Featherstone's articulated-body recursion (Rigid Body Dynamics Algorithms, 2008, table
7.1) does it link by link, tip to root and back; here each link has three degrees of freedom, turn,
forward, up, about its own hinge, the axes those of the world. For a link turned by angle w' and a
point (x, z) from its hinge, the point's acceleration is a + w' (z, -x) - w^2 (x, z).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import Link, Motor
from workbench.sim.compiling import compiled
from workbench.sim.ground import planar_forces, planar_forces_again
from workbench.sim.laws import top_force
from workbench.sim.uneven import ripple, servo_rate

__all__ = ["step_chains"]

Array = NDArray[np.float64]

_HIGHEST = 1e10
"""Beyond it the engine calls an acceleration bad (mjMAXVAL)."""

_MASS, _X, _Z, _INERTIA, _AT_X, _AT_Z, _TURN = (int(Link(k)) for k in range(7))
_K0, _K1, _K2, _REST, _D0, _D1, _D2, _ARMATURE = (int(Link(k)) for k in range(7, 15))
_OF, _GAIN, _OFFSET, _STIFFNESS, _DAMPING, _ADDRESS, _UNEVEN, _RIPPLED, _DROOP = map(int, Motor)

# columns of a link's work: place of its hinge from the one before; what the turning of the link
# before adds to its acceleration; articulated inertia, (turn, forward, up) and symmetric; force;
# 1 / inertia of the hinge, its torque; speed of its hinge in the world; cosine and sine
_RX, _RZ, _CX, _CZ, _II, _IX, _IZ, _XX, _XZ, _ZZ, _FI, _FX, _FZ, _OVER, _TORQUE = range(15)
_VX, _VZ, _COS, _SIN = range(15, 19)
_WORK = 19


def step_chains(
    links: Array,
    motors: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: Array,
    root: int,
    rows: NDArray[np.int64],
    qpos: Array,
    qvel: Array,
    act: Array,
    control: Array,
    userdata: Array,
    same: NDArray[np.bool_],
    steps: int,
    torque: Array,
    broken: NDArray[np.bool_],
) -> None:
    """Step some simulations of equal layout in place; one that breaks keeps the state it had.

    Args:
        links, motors, ground, laws, top, gravity, step: of `Chain`, stacked, (s, ...).
        root: degrees of freedom of the root.
        rows: which are stepped.
        qpos, qvel, act, control, userdata: (s, ...) of the engine's state.
        same: (s,) whether `userdata` has the forces of this very state.
        steps: how many.
        torque: (s, nu) of the last step's motors, written.
        broken: (s,) set where an acceleration is none; those are not stepped again.
    """
    count = links.shape[1] - 1
    q, v = np.empty(count + 3), np.empty(count + 3)
    activation, user = np.empty(act.shape[1]), np.empty(userdata.shape[1])
    work = np.empty((count + 1, _WORK))
    for row in rows:
        if broken[row]:
            continue
        _take(root, qpos[row], qvel[row], q, v)
        activation[:] = act[row]
        user[:] = userdata[row]
        sane = _advance(
            links[row], motors[row], ground[row], laws[row], top[row], gravity[row], step[row],
            root > 0, q, v, activation, control[row], user, same[row], steps, torque[row], work,
        )  # fmt: skip
        if not sane:
            broken[row] = True
            continue
        _give(root, q, v, qpos[row], qvel[row])
        act[row] = activation
        userdata[row] = user


@numba.njit
def _take(root: int, qpos: Array, qvel: Array, q: Array, v: Array) -> None:
    """Copy the engine's coordinates to forward, up, pitch of the root and the hinges' angles."""
    if root == 6:
        q[0], q[1], q[2] = qpos[0], qpos[2], 2 * math.atan2(qpos[5], qpos[3])
        v[0], v[1], v[2] = qvel[0], qvel[2], qvel[4]
        q[3:] = qpos[7:]
        v[3:] = qvel[6:]
        return
    q[: 3 - root] = 0.0
    v[: 3 - root] = 0.0
    q[3 - root :] = qpos
    v[3 - root :] = qvel


@numba.njit
def _give(root: int, q: Array, v: Array, qpos: Array, qvel: Array) -> None:
    """Copy them back."""
    if root == 6:
        qpos[0], qpos[2] = q[0], q[1]
        qpos[3], qpos[5] = math.cos(q[2] / 2), math.sin(q[2] / 2)
        qvel[0], qvel[2], qvel[4] = v[0], v[1], v[2]
        qpos[7:] = q[3:]
        qvel[6:] = v[3:]
        return
    qpos[:] = q[3 - root :]
    qvel[:] = v[3 - root :]


@numba.njit
def _advance(
    links: Array,
    motors: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: float,
    free: bool,
    q: Array,
    v: Array,
    act: Array,
    control: Array,
    user: Array,
    same: bool,
    steps: int,
    torque: Array,
    work: Array,
) -> bool:
    """Step one chain; return whether every acceleration was one."""
    last = links.shape[0] - 1
    foot = np.empty(3)
    for k in range(steps):
        foot[:] = 0.0
        if ground.shape[0] > 0:
            if same and k == 0:
                planar_forces_again(ground, q, user, foot)
            else:
                planar_forces(ground, q, v, user, foot)
        x = _place(links, q, v, work)
        if laws.shape[0] > 0:
            _pull(links, laws, top, x, q, v, work)
        for link in range(last, 0, -1):
            _inward(links[link], motors, step, link, q, v, act, control, torque, work)
        turn, forward, up = _root(work[0], foot) if free else (0.0, -gravity[0], -gravity[1])
        if not abs(turn) + abs(forward) + abs(up) < _HIGHEST:
            return False
        if free:
            v[0] += step * (forward + gravity[0])
            v[1] += step * (up + gravity[1])
            v[2] += step * turn
        for motor in range(motors.shape[0]):
            _activate(motors[motor], step, q, v, act, control[motor], work)
        for link in range(1, last + 1):
            w = work[link]
            forward, up = forward + turn * w[_RZ] + w[_CX], up - turn * w[_RX] + w[_CZ]
            held = w[_II] * turn + w[_IX] * forward + w[_IZ] * up
            own = (w[_TORQUE] - held) * w[_OVER]
            if not abs(own) < _HIGHEST:
                return False
            turn += own
            v[2 + link] += step * own
        for i in range(0 if free else 3, last + 3):
            q[i] += step * v[i]
    return True


@numba.njit
def _place(links: Array, q: Array, v: Array, work: Array) -> float:
    """Write each link's place, inertia and centrifugal force; return where the root is forward."""
    angle, turn = q[2], v[2]
    c, s = math.cos(angle), math.sin(angle)
    vx, vz = v[0], v[1]
    for k in range(links.shape[0]):
        link, w = links[k], work[k]
        if k > 0:
            x, z = c * link[_AT_X] + s * link[_AT_Z], c * link[_AT_Z] - s * link[_AT_X]
            w[_RX], w[_RZ] = x, z
            w[_CX], w[_CZ] = -turn * turn * x, -turn * turn * z
            vx, vz = vx + turn * z, vz - turn * x
            angle += link[_TURN] + q[2 + k]
            turn += v[2 + k]
            c, s = math.cos(angle), math.sin(angle)
        x, z, mass = c * link[_X] + s * link[_Z], c * link[_Z] - s * link[_X], link[_MASS]
        w[_II], w[_IX], w[_IZ] = link[_INERTIA] + mass * (x * x + z * z), mass * z, -mass * x
        w[_XX], w[_XZ], w[_ZZ] = mass, 0.0, mass
        w[_FI], w[_FX], w[_FZ] = 0.0, -mass * turn * turn * x, -mass * turn * turn * z
        w[_VX], w[_VZ], w[_COS], w[_SIN] = vx, vz, c, s
    return q[0]


@numba.njit
def _pull(
    links: Array, laws: Array, top: Array, x: float, q: Array, v: Array, work: Array
) -> None:
    """Add what `laws` does to T and at the foot's hinge."""
    carrier, turn = int(top[0]), v[2]
    for k in range(1, carrier + 1):
        x += work[k, _RX]
        turn += v[2 + k]
    w = work[carrier]
    dx = w[_COS] * top[1] + w[_SIN] * top[2]
    dz = w[_COS] * top[2] - w[_SIN] * top[1]
    fx, _, fz = top_force(laws, x + dx, w[_VX] + turn * dz, 0.0, w[_VZ] - turn * dx)
    w[_FI] -= dz * fx - dx * fz
    w[_FX] -= fx
    w[_FZ] -= fz
    if laws[5] > 0.0:  # within the play the spring of the foot's hinge, the first, gives nothing
        bent = q[3] - links[1, _REST]
        work[1, _FI] -= links[1, _K0] * min(max(bent, -laws[5]), laws[5])


@numba.njit
def _inward(
    link: Array,
    motors: Array,
    step: float,
    k: int,
    q: Array,
    v: Array,
    act: Array,
    control: Array,
    torque: Array,
    work: Array,
) -> None:
    """Put a link, as far as its hinge holds it, into the one before."""
    w, before = work[k], work[k - 1]
    bent, speed = q[2 + k] - link[_REST], v[2 + k]
    far, fast = abs(bent), abs(speed)
    own = -bent * (link[_K0] + far * (link[_K1] + far * link[_K2]))
    own -= speed * (link[_D0] + fast * (link[_D1] + fast * link[_D2]))
    damping = link[_D0] + fast * (2 * link[_D1] + fast * 3 * link[_D2])
    for i in range(motors.shape[0]):
        if int(motors[i, _OF]) == k:
            torque[i] = _torque(motors[i], q[2 + k], speed, act, control[i], w)
            own += torque[i]
            damping -= motors[i, _DAMPING]
    a, b, c = w[_II], w[_IX], w[_IZ]
    over = 1.0 / (a + link[_ARMATURE] + step * damping)
    own -= w[_FI]
    w[_OVER], w[_TORQUE] = over, own
    own *= over
    xx, xz, zz = w[_XX] - b * b * over, w[_XZ] - b * c * over, w[_ZZ] - c * c * over
    ii, ix, iz = a - a * a * over, b - a * b * over, c - a * c * over
    cx, cz, rx, rz = w[_CX], w[_CZ], w[_RX], w[_RZ]
    fi = w[_FI] + ix * cx + iz * cz + a * own
    fx = w[_FX] + xx * cx + xz * cz + b * own
    fz = w[_FZ] + xz * cx + zz * cz + c * own
    at_x, at_z = ix + xx * rz - xz * rx, iz + xz * rz - zz * rx
    before[_II] += ii + rz * ix - rx * iz + rz * at_x - rx * at_z
    before[_IX] += at_x
    before[_IZ] += at_z
    before[_XX] += xx
    before[_XZ] += xz
    before[_ZZ] += zz
    before[_FI] += fi + rz * fx - rx * fz
    before[_FX] += fx
    before[_FZ] += fz


@numba.njit
def _torque(
    motor: Array, angle: float, speed: float, act: Array, command: float, w: Array
) -> float:
    """Return the torque of a motor [N m]."""
    gain, address = motor[_GAIN], int(motor[_ADDRESS])
    if motor[_RIPPLED] != 0.0:
        gain = motor[_DROOP] * ripple(motor[_DROOP + 1 :], w[_COS], w[_SIN])
    driven = command if address < 0 else act[address]
    return gain * driven + motor[_OFFSET] + motor[_STIFFNESS] * angle + motor[_DAMPING] * speed


@numba.njit
def _activate(
    motor: Array, step: float, q: Array, v: Array, act: Array, command: float, work: Array
) -> None:
    """Move a motor's activation on; the speeds are still those before the step."""
    address, k = int(motor[_ADDRESS]), int(motor[_OF])
    if address < 0:
        return
    rate = command
    if motor[_UNEVEN] != 0.0:
        w, apart = work[k], act[address] - q[2 + k]
        rate = servo_rate(motor[_DROOP:], command, apart, v[2 + k], w[_COS], w[_SIN])
    act[address] += step * rate


@numba.njit
def _root(w: Array, foot: Array) -> tuple[float, float, float]:
    """Return the acceleration of a free root, turn, forward, up, less gravity.

    Args:
        w: its work.
        foot: force forward, up and torque of the ground.
    """
    a, b, c, d, e, f = w[_II], w[_IX], w[_IZ], w[_XX], w[_XZ], w[_ZZ]
    torque, fx, fz = foot[2] - w[_FI], foot[0] - w[_FX], foot[1] - w[_FZ]
    over = 1.0 / (d * f - e * e)
    xx, xz, zz = f * over, -e * over, d * over
    along, above = b * xx + c * xz, b * xz + c * zz
    turn = (torque - along * fx - above * fz) / (a - along * b - above * c)
    fx, fz = fx - b * turn, fz - c * turn
    return turn, xx * fx + xz * fz, xz * fx + zz * fz


step_chains = compiled(step_chains)
