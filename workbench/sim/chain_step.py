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

import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import Link, Motor
from workbench.sim.chain_links import (
    COS,
    CX,
    CZ,
    FI,
    FX,
    FZ,
    II,
    IX,
    IZ,
    LOSS,
    OVER,
    RX,
    RZ,
    SIN,
    TORQUE,
    WORK,
    XX,
    XZ,
    ZZ,
    bend_hinges,
    compile_part,
    place_links,
    pull_top,
    take_coordinates,
)
from workbench.sim.compiling import compiled
from workbench.sim.ground import planar_forces, planar_forces_again
from workbench.sim.uneven import ripple, servo_rate

__all__ = ["step_chains"]

Array = NDArray[np.float64]

_HIGHEST = 1e10
"""Beyond it the engine calls an acceleration bad (mjMAXVAL)."""

_ARMATURE = int(Link.ARMATURE)
_OF, _GAIN, _OFFSET, _STIFFNESS, _DAMPING, _ADDRESS, _UNEVEN, _RIPPLED, _DROOP = map(int, Motor)


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
    work = np.empty((links.shape[1], WORK))
    for row in rows:
        if broken[row]:
            continue
        qpos, qvel = _part(state, row, places[0]), _part(state, row, places[1])
        control, same = _part(state, row, places[3]), True
        for k in (0, 1, 4):
            for i in range(places[k, 0], places[k, 1]):
                same = same and state[row, i] == forced[row, i]
        take_coordinates(root, qpos, qvel, q, v)
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
        place_links(links[row], q, v, work)
        _show(bodies[row], root, q, work, xpos[row], xmat[row], xanchor[row])


@compile_part
def _show(
    bodies: Array, root: int, q: Array, work: Array, xpos: Array, xmat: Array, xanchor: Array
) -> None:
    """Write where bodies and hinges are."""
    x, z, body = q[0], q[1], 1
    first = xanchor.shape[0] - work.shape[0] + 1
    for k in range(work.shape[0]):
        if k > 0:
            x, z = x + work[k, RX], z + work[k, RZ]
            xanchor[first + k - 1, 0], xanchor[first + k - 1, 2] = x, z
        elif root > 0:
            xanchor[first - 1, 0], xanchor[first - 1, 2] = x, z
        c, s = work[k, COS], work[k, SIN]
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


@compile_part
def _part(state: Array, row: int, place: NDArray[np.int64]) -> Array:
    return state[row, place[0] : place[1]]


@compile_part
def _copy(values: Array, to: Array) -> None:
    for i in range(len(values)):
        to[i] = values[i]


@compile_part
def _give(root: int, q: Array, v: Array, qpos: Array, qvel: Array) -> None:
    """Copy them back."""
    if root == 6:
        qpos[0], qpos[2] = q[0], q[1]
        qpos[3], qpos[5] = math.cos(q[2] / 2), math.sin(q[2] / 2)
        qvel[0], qvel[2], qvel[4] = v[0], v[1], v[2]
    places, speeds = len(qpos) - len(q), len(qvel) - len(v)
    for i in range(3 if root == 6 else 3 - root, len(q)):
        qpos[places + i], qvel[speeds + i] = q[i], v[i]


@compile_part
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
        place_links(links, q, v, work)
        bend_hinges(links, q, v, work)
        for i in range(motors.shape[0]):
            _turn(motors, i, q, v, act, control, torque, work)
        if laws[0] != 0.0:
            pull_top(links, laws, top, q, v, work)
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
            rx, rz = work[k, RX], work[k, RZ]
            forward, up = forward + turn * rz + work[k, CX], up - turn * rx + work[k, CZ]
            held = work[k, II] * turn + work[k, IX] * forward + work[k, IZ] * up
            own = (work[k, TORQUE] - held) * work[k, OVER]
            if not abs(own) < _HIGHEST:
                return False
            turn += own
            v[2 + k] += step * own
        for i in range(0 if free else 3, last + 3):
            q[i] += step * v[i]
    return True


@compile_part
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
        gain *= ripple(motors[i, _DROOP + 1 :], work[k, COS], work[k, SIN])
    driven = control[i] if address < 0 else act[address]
    passive = motors[i, _STIFFNESS] * q[2 + k] + motors[i, _DAMPING] * v[2 + k]
    torque[i] = gain * driven + motors[i, _OFFSET] + passive
    work[k, TORQUE] += torque[i]
    work[k, LOSS] -= motors[i, _DAMPING]


@compile_part
def _activate(
    motors: Array, i: int, step: float, q: Array, v: Array, act: Array, control: Array, work: Array
) -> None:
    """Move a motor's activation on; hinges have the speeds that they had before the step."""
    k, address, rate = int(motors[i, _OF]), int(motors[i, _ADDRESS]), control[i]
    if address < 0:
        return
    if motors[i, _UNEVEN] != 0.0:
        apart, numbers = act[address] - q[2 + k], motors[i, _DROOP:]
        rate = servo_rate(numbers, rate, apart, v[2 + k], work[k, COS], work[k, SIN])
    act[address] += step * rate


@compile_part
def _inward(links: Array, step: float, work: Array) -> None:
    """Put each link, as far as its hinge holds it, into the one before."""
    for k in range(links.shape[0] - 1, 0, -1):
        a, b, c = work[k, II], work[k, IX], work[k, IZ]
        over = 1.0 / (a + links[k, _ARMATURE] + step * work[k, LOSS])
        work[k, TORQUE] -= work[k, FI]
        work[k, OVER] = over
        own = work[k, TORQUE] * over
        xx, xz, zz = work[k, XX], work[k, XZ], work[k, ZZ]
        xx, xz, zz = xx - b * b * over, xz - b * c * over, zz - c * c * over
        ii, ix, iz = a - a * a * over, b - a * b * over, c - a * c * over
        rx, rz, cx, cz = work[k, RX], work[k, RZ], work[k, CX], work[k, CZ]
        fi = work[k, FI] + ix * cx + iz * cz + a * own
        fx = work[k, FX] + xx * cx + xz * cz + b * own
        fz = work[k, FZ] + xz * cx + zz * cz + c * own
        at_x, at_z = ix + xx * rz - xz * rx, iz + xz * rz - zz * rx
        work[k - 1, II] += ii + rz * ix - rx * iz + rz * at_x - rx * at_z
        work[k - 1, IX] += at_x
        work[k - 1, IZ] += at_z
        work[k - 1, XX] += xx
        work[k - 1, XZ] += xz
        work[k - 1, ZZ] += zz
        work[k - 1, FI] += fi + rz * fx - rx * fz
        work[k - 1, FX] += fx
        work[k - 1, FZ] += fz


@compile_part
def _root(work: Array, foot: Array) -> tuple[float, float, float]:
    """Return the acceleration of a free root, turn, forward, up, less gravity.

    Args:
        work: of the links.
        foot: force forward, up and torque of the ground.
    """
    a, b, c = work[0, II], work[0, IX], work[0, IZ]
    d, e, f = work[0, XX], work[0, XZ], work[0, ZZ]
    fx, fz = foot[0] - work[0, FX], foot[1] - work[0, FZ]
    over = 1.0 / (d * f - e * e)
    xx, xz, zz = f * over, -e * over, d * over
    along, above = b * xx + c * xz, b * xz + c * zz
    torque = foot[2] - work[0, FI] - along * fx - above * fz
    turn = torque / (a - along * b - above * c)
    fx, fz = fx - b * turn, fz - c * turn
    return turn, xx * fx + xz * fz, xz * fx + zz * fz


step_chains: Callable[..., None] = compiled(_step_chains)
