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
from collections.abc import Callable

import numba
import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import Link, Motor
from workbench.sim.compiling import compiled
from workbench.sim.ground import GROUND_RECORD, planar_forces, planar_forces_again
from workbench.sim.laws import top_force
from workbench.sim.uneven import ripple, servo_rate

__all__ = ["step_chains", "stiffness_of_chain"]

Array = NDArray[np.float64]

_njit = numba.njit(error_model="numpy")  # no test for zero at each division

_HIGHEST = 1e10
"""Beyond it the engine calls an acceleration bad (mjMAXVAL)."""

_MASS, _X, _Z, _INERTIA, _AT_X, _AT_Z, _TURN = (int(Link(k)) for k in range(7))
_K0, _K1, _K2, _REST, _D0, _D1, _D2, _ARMATURE = (int(Link(k)) for k in range(7, 15))
_OF, _GAIN, _OFFSET, _STIFFNESS, _DAMPING, _ADDRESS, _UNEVEN, _RIPPLED, _DROOP = map(int, Motor)

# columns of a link's work: place of its hinge from the one before; what the turning of the link
# before adds to its acceleration; articulated inertia, (turn, forward, up) and symmetric; force;
# 1 / inertia of the hinge; its torque and damping; speed of its hinge in the world; cosine and sine
_RX, _RZ, _CX, _CZ, _II, _IX, _IZ, _XX, _XZ, _ZZ, _FI, _FX, _FZ, _OVER = range(14)
_TORQUE, _LOSS, _VX, _VZ, _COS, _SIN = range(14, 20)
_WORK = 20


def _step_chains(
    links: Array,
    motors: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: Array,
    root: int,
    rows: NDArray[np.int32],
    state: Array,
    forced: Array,
    places: NDArray[np.int64],
    steps: int,
    torque: Array,
    broken: NDArray[np.bool_],
    bodies: Array,
    xpos: Array,
    xmat: Array,
    xanchor: Array,
) -> None:
    """Step some simulations of equal layout in place; one that breaks keeps the state it had.

    Args:
        links: of `Chain`, as all that follows up to the step, stacked, (s, n + 1, 15).
        motors: (s, nu, 13).
        ground: (s, 18).
        laws: (s, 10).
        top: (s, 4).
        gravity: (s, 2) [m/s^2].
        step: (s,) [s].
        root: degrees of freedom of the root.
        rows: which are stepped.
        state: (s, size) mjSTATE_INTEGRATION.
        forced: (s, size) states of which `userdata` has the forces; a state that was corrected
            since then gets new ones.
        places: (6, 2) where in the state qpos, qvel, act, ctrl, userdata and time begin and end.
        steps: how many.
        torque: (s, nu) of the last step's motors, written.
        broken: (s,) set where an acceleration is none; those are not stepped again.
        bodies: (s, nbody, 4) of `Chain`.
        xpos: (s, nbody, 3) places of the bodies after the steps, as all that follows written where
            the motion changes them [m].
        xmat: (s, nbody, 9).
        xanchor: (s, njnt, 3) of hinges [m].
    """
    count = links.shape[1] + 2
    q, v, foot = np.empty(count), np.empty(count), np.empty(3)
    act, user = np.empty(places[2, 1] - places[2, 0]), np.empty(places[4, 1] - places[4, 0])
    work = np.empty((links.shape[1], _WORK))
    for row in rows:
        if broken[row]:
            continue
        qpos, qvel = _part(state, row, places[0]), _part(state, row, places[1])
        control, same = _part(state, row, places[3]), True
        for k in (0, 1, 4):
            for i in range(places[k, 0], places[k, 1]):
                same = same and state[row, i] == forced[row, i]
        _take(root, qpos, qvel, q, v)
        _copy(_part(state, row, places[2]), act)
        _copy(_part(state, row, places[4]), user)
        broken[row] = not _advance(
            links[row], motors[row], ground[row], laws[row], top[row], gravity[row],
            float(step[row]), root > 0, q, v, act, control, user, same, steps, torque[row], foot,
            work,
        )  # fmt: skip
        if broken[row]:
            continue
        _give(root, q, v, qpos, qvel)
        _copy(act, _part(state, row, places[2]))
        _copy(user, _part(state, row, places[4]))
        state[row, places[5, 0]] += steps * step[row]
        _place(links[row], q, v, work)
        _show(bodies[row], root, q, work, xpos[row], xmat[row], xanchor[row])


@_njit
def _show(
    bodies: Array, root: int, q: Array, work: Array, xpos: Array, xmat: Array, xanchor: Array
) -> None:
    """Write where bodies and hinges are."""
    x, z, body = q[0], q[1], 1
    first = xanchor.shape[0] - work.shape[0] + 1
    for k in range(work.shape[0]):
        if k > 0:
            x, z = x + work[k, _RX], z + work[k, _RZ]
            xanchor[first + k - 1, 0], xanchor[first + k - 1, 2] = x, z
        elif root > 0:
            xanchor[first - 1, 0], xanchor[first - 1, 2] = x, z
        c, s = work[k, _COS], work[k, _SIN]
        while body < len(bodies) and bodies[body, 0] == k:
            dx, dz, turn = bodies[body, 1], bodies[body, 2], bodies[body, 3]
            xpos[body, 0], xpos[body, 2] = x + c * dx + s * dz, z + c * dz - s * dx
            a, b = (
                (c, s)
                if turn == 0.0
                else (
                    c * math.cos(turn) - s * math.sin(turn),
                    s * math.cos(turn) + c * math.sin(turn),
                )
            )
            xmat[body, 0], xmat[body, 2], xmat[body, 6], xmat[body, 8] = a, b, -b, a
            body += 1


@_njit
def _part(state: Array, row: int, place: NDArray[np.int64]) -> Array:
    return state[row, place[0] : place[1]]


@_njit
def _copy(values: Array, to: Array) -> None:
    for i in range(len(values)):
        to[i] = values[i]


@_njit
def _take(root: int, qpos: Array, qvel: Array, q: Array, v: Array) -> None:
    """Copy the engine's coordinates to forward, up, pitch of the root and the hinges' angles."""
    first = 3 if root == 6 else 3 - root
    for i in range(first):
        q[i] = v[i] = 0.0
    if root == 6:
        q[0], q[1], q[2] = qpos[0], qpos[2], 2 * math.atan2(qpos[5], qpos[3])
        v[0], v[1], v[2] = qvel[0], qvel[2], qvel[4]
    places, speeds = len(qpos) - len(q), len(qvel) - len(v)
    for i in range(first, len(q)):
        q[i], v[i] = qpos[places + i], qvel[speeds + i]


@_njit
def _give(root: int, q: Array, v: Array, qpos: Array, qvel: Array) -> None:
    """Copy them back."""
    if root == 6:
        qpos[0], qpos[2] = q[0], q[1]
        qpos[3], qpos[5] = math.cos(q[2] / 2), math.sin(q[2] / 2)
        qvel[0], qvel[2], qvel[4] = v[0], v[1], v[2]
    places, speeds = len(qpos) - len(q), len(qvel) - len(v)
    for i in range(3 if root == 6 else 3 - root, len(q)):
        qpos[places + i], qvel[speeds + i] = q[i], v[i]


@_njit
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
    foot: Array,
    work: Array,
) -> bool:
    """Step one chain; return whether every acceleration was one."""
    last = links.shape[0] - 1
    for done in range(steps):
        foot[0] = foot[1] = foot[2] = 0.0
        if ground[0] != 0.0:
            if same and done == 0:
                planar_forces_again(ground, q, user, foot)
            else:
                planar_forces(ground, q, v, user, foot)
        _place(links, q, v, work)
        _bend(links, q, v, work)
        for i in range(motors.shape[0]):
            _turn(motors, i, q, v, act, control, torque, work)
        if laws[0] != 0.0:
            _pull(links, laws, top, q, v, work)
        _inward(links, step, work)
        turn, forward, up = _root(work, foot) if free else (0.0, -gravity[0], -gravity[1])
        if not abs(turn) + abs(forward) + abs(up) < _HIGHEST:
            return False
        if free:
            v[0] += step * (forward + gravity[0])
            v[1] += step * (up + gravity[1])
            v[2] += step * turn
        for i in range(motors.shape[0]):
            _activate(motors, i, step, q, v, act, control, work)
        for k in range(1, last + 1):
            rx, rz = work[k, _RX], work[k, _RZ]
            forward, up = forward + turn * rz + work[k, _CX], up - turn * rx + work[k, _CZ]
            held = work[k, _II] * turn + work[k, _IX] * forward + work[k, _IZ] * up
            own = (work[k, _TORQUE] - held) * work[k, _OVER]
            if not abs(own) < _HIGHEST:
                return False
            turn += own
            v[2 + k] += step * own
        for i in range(0 if free else 3, last + 3):
            q[i] += step * v[i]
    return True


@_njit
def _place(links: Array, q: Array, v: Array, work: Array) -> None:
    """Write each link's place, inertia and centrifugal force."""
    angle, turn = q[2], v[2]
    c, s = math.cos(angle), math.sin(angle)
    vx, vz = v[0], v[1]
    for k in range(links.shape[0]):
        if k > 0:
            x = c * links[k, _AT_X] + s * links[k, _AT_Z]
            z = c * links[k, _AT_Z] - s * links[k, _AT_X]
            work[k, _RX], work[k, _RZ] = x, z
            work[k, _CX], work[k, _CZ] = -turn * turn * x, -turn * turn * z
            vx, vz = vx + turn * z, vz - turn * x
            angle += links[k, _TURN] + q[2 + k]
            turn += v[2 + k]
            c, s = math.cos(angle), math.sin(angle)
        mass = links[k, _MASS]
        x = mass * (c * links[k, _X] + s * links[k, _Z])
        z = mass * (c * links[k, _Z] - s * links[k, _X])
        work[k, _II], work[k, _IX], work[k, _IZ] = links[k, _INERTIA], z, -x
        work[k, _XX], work[k, _XZ], work[k, _ZZ] = mass, 0.0, mass
        work[k, _FI], work[k, _FX], work[k, _FZ] = 0.0, -turn * turn * x, -turn * turn * z
        work[k, _VX], work[k, _VZ], work[k, _COS], work[k, _SIN] = vx, vz, c, s


@_njit
def _bend(links: Array, q: Array, v: Array, work: Array) -> None:
    """Write the torque of each hinge's spring and damper, and the damper's derivative."""
    for k in range(1, links.shape[0]):
        bent, speed = q[2 + k] - links[k, _REST], v[2 + k]
        fast = abs(speed)
        spring = bent * (links[k, _K0] + bent * (links[k, _K1] + bent * links[k, _K2]))
        damper = speed * (links[k, _D0] + fast * (links[k, _D1] + fast * links[k, _D2]))
        work[k, _TORQUE] = -spring - damper
        work[k, _LOSS] = links[k, _D0] + fast * (2 * links[k, _D1] + fast * 3 * links[k, _D2])


@_njit
def _turn(
    motors: Array,
    i: int,
    q: Array,
    v: Array,
    act: Array,
    control: Array,
    torque: Array,
    work: Array,
) -> None:
    """Add the torque of a motor to that of its hinge."""
    k, gain, address = int(motors[i, _OF]), motors[i, _GAIN], int(motors[i, _ADDRESS])
    if motors[i, _RIPPLED] != 0.0:
        gain *= ripple(motors[i, _DROOP + 1 :], work[k, _COS], work[k, _SIN])
    driven = control[i] if address < 0 else act[address]
    passive = motors[i, _STIFFNESS] * q[2 + k] + motors[i, _DAMPING] * v[2 + k]
    torque[i] = gain * driven + motors[i, _OFFSET] + passive
    work[k, _TORQUE] += torque[i]
    work[k, _LOSS] -= motors[i, _DAMPING]


@_njit
def _activate(
    motors: Array, i: int, step: float, q: Array, v: Array, act: Array, control: Array, work: Array
) -> None:
    """Move a motor's activation on; hinges have the speeds that they had before the step."""
    k, address, rate = int(motors[i, _OF]), int(motors[i, _ADDRESS]), control[i]
    if address < 0:
        return
    if motors[i, _UNEVEN] != 0.0:
        apart, numbers = act[address] - q[2 + k], motors[i, _DROOP:]
        rate = servo_rate(numbers, rate, apart, v[2 + k], work[k, _COS], work[k, _SIN])
    act[address] += step * rate


@_njit
def _pull(links: Array, laws: Array, top: Array, q: Array, v: Array, work: Array) -> None:
    """Add what `laws` does to T and at the foot's hinge."""
    carrier, x, turn = int(top[0]), q[0], v[2]
    for k in range(1, carrier + 1):
        x += work[k, _RX]
        turn += v[2 + k]
    c, s = work[carrier, _COS], work[carrier, _SIN]
    dx, dz = c * top[1] + s * top[2], c * top[2] - s * top[1]
    vx, vz = work[carrier, _VX] + turn * dz, work[carrier, _VZ] - turn * dx
    fx, _, fz = top_force(laws, x + dx, vx, 0.0, vz)
    _burden(work, carrier, top, fx, fz)
    if laws[5] > 0.0:  # within the play the spring of the foot's hinge, the first, gives nothing
        bent = q[3] - links[1, _REST]
        work[1, _TORQUE] += links[1, _K0] * min(max(bent, -laws[5]), laws[5])


@_njit
def _inward(links: Array, step: float, work: Array) -> None:
    """Put each link, as far as its hinge holds it, into the one before."""
    for k in range(links.shape[0] - 1, 0, -1):
        a, b, c = work[k, _II], work[k, _IX], work[k, _IZ]
        over = 1.0 / (a + links[k, _ARMATURE] + step * work[k, _LOSS])
        work[k, _TORQUE] -= work[k, _FI]
        work[k, _OVER] = over
        own = work[k, _TORQUE] * over
        xx, xz, zz = work[k, _XX], work[k, _XZ], work[k, _ZZ]
        xx, xz, zz = xx - b * b * over, xz - b * c * over, zz - c * c * over
        ii, ix, iz = a - a * a * over, b - a * b * over, c - a * c * over
        rx, rz, cx, cz = work[k, _RX], work[k, _RZ], work[k, _CX], work[k, _CZ]
        fi = work[k, _FI] + ix * cx + iz * cz + a * own
        fx = work[k, _FX] + xx * cx + xz * cz + b * own
        fz = work[k, _FZ] + xz * cx + zz * cz + c * own
        at_x, at_z = ix + xx * rz - xz * rx, iz + xz * rz - zz * rx
        work[k - 1, _II] += ii + rz * ix - rx * iz + rz * at_x - rx * at_z
        work[k - 1, _IX] += at_x
        work[k - 1, _IZ] += at_z
        work[k - 1, _XX] += xx
        work[k - 1, _XZ] += xz
        work[k - 1, _ZZ] += zz
        work[k - 1, _FI] += fi + rz * fx - rx * fz
        work[k - 1, _FX] += fx
        work[k - 1, _FZ] += fz


@_njit
def _root(work: Array, foot: Array) -> tuple[float, float, float]:
    """Return the acceleration of a free root, turn, forward, up, less gravity.

    Args:
        work: of the links.
        foot: force forward, up and torque of the ground.
    """
    a, b, c = work[0, _II], work[0, _IX], work[0, _IZ]
    d, e, f = work[0, _XX], work[0, _XZ], work[0, _ZZ]
    fx, fz = foot[0] - work[0, _FX], foot[1] - work[0, _FZ]
    over = 1.0 / (d * f - e * e)
    xx, xz, zz = f * over, -e * over, d * over
    along, above = b * xx + c * xz, b * xz + c * zz
    torque = foot[2] - work[0, _FI] - along * fx - above * fz
    turn = torque / (a - along * b - above * c)
    fx, fz = fx - b * turn, fz - c * turn
    return turn, xx * fx + xz * fz, xz * fx + zz * fz


def _stiffness_of_chain(
    links: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    root: int,
    qpos: Array,
    directions: Array,
    dofs: NDArray[np.int64],
    step: float,
    pulled: Array,
    pull: Array,
) -> Array:
    """Return minus the derivative of the force that nothing balances, (n, n), at rest.

    Central differences; the foot's corners lock where they are.

    Args:
        links: of `Chain`, as all that follows up to the root.
        ground: (18,).
        laws: (10,).
        top: (4,).
        gravity: (2,) [m/s^2].
        root: degrees of freedom of the root.
        qpos: (nq,) of the engine.
        directions: (n, links + 2) what moves, per unit; forward, up, pitch of the root, hinges.
        dofs: (n,) whose forces are returned, counted likewise.
        step: of the differences [m, rad].
        pulled: (4,) link and place of a force on T.
        pull: (2,) that force, forward and up [N].
    """
    size, count = len(dofs), links.shape[0] + 2
    q, v, rest, foot = np.empty(count), np.zeros(count), np.zeros(count + 3), np.empty(3)
    user, work = np.empty(GROUND_RECORD), np.empty((links.shape[0], _WORK))
    sides, found = np.empty((2, size)), np.empty((size, size))
    for column in range(size):
        for side in range(2):
            _take(root, qpos, rest, q, v)
            for i in range(count):
                q[i] += (step - 2 * step * side) * directions[column, i]
            user[:] = 0.0
            foot[0] = foot[1] = foot[2] = 0.0
            if ground[0] != 0.0:
                planar_forces(ground, q, v, user, foot)
            _place(links, q, v, work)
            _bend(links, q, v, work)
            if laws[0] != 0.0:
                _pull(links, laws, top, q, v, work)
            _burden(work, int(pulled[0]), pulled, pull[0], pull[1])
            _weigh(gravity, foot, work)
            for i in range(size):
                k = dofs[i]
                sides[side, i] = (
                    -work[0, _FX + k]
                    if k < 2
                    else -work[0, _FI]
                    if k == 2
                    else work[k - 2, _TORQUE]
                )
        for i in range(size):
            found[i, column] = (sides[1, i] - sides[0, i]) / (2 * step)
    return found


@_njit
def _burden(work: Array, k: int, place: Array, fx: float, fz: float) -> None:
    """Let a force act on a link at a place of its frame."""
    c, s = work[k, _COS], work[k, _SIN]
    dx, dz = c * place[1] + s * place[2], c * place[2] - s * place[1]
    work[k, _FI] -= dz * fx - dx * fz
    work[k, _FX] -= fx
    work[k, _FZ] -= fz


@_njit
def _weigh(gravity: Array, foot: Array, work: Array) -> None:
    """Sum up, tip to root, what gravity and forces on links do at each hinge of a chain at rest."""
    for k in range(work.shape[0] - 1, -1, -1):
        work[k, _FI] -= work[k, _IX] * gravity[0] + work[k, _IZ] * gravity[1]
        work[k, _FX] -= work[k, _XX] * gravity[0]
        work[k, _FZ] -= work[k, _XX] * gravity[1]
        if k == 0:
            work[0, _FI] -= foot[2]
            work[0, _FX] -= foot[0]
            work[0, _FZ] -= foot[1]
            break
        work[k, _TORQUE] -= work[k, _FI]
        fx, fz = work[k, _FX], work[k, _FZ]
        work[k - 1, _FI] += work[k, _FI] + work[k, _RZ] * fx - work[k, _RX] * fz
        work[k - 1, _FX] += fx
        work[k - 1, _FZ] += fz


stiffness_of_chain: Callable[..., Array] = compiled(_stiffness_of_chain)
step_chains: Callable[..., None] = compiled(_step_chains)
