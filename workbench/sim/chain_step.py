"""Steps of planar chains, compiled: the engine's `implicitfast`, by articulated bodies.

A step solves (M + h D) a = f for the acceleration a of the hinges' angles (`chain_acceleration`)
and integrates

    v <- v + h a,    q <- q + h v,

with M the inertia, D the derivative of dampers and drives by the speeds, f all forces at the state
before it. Dry friction is found with M alone (`chain_friction`) and is one of these forces.

Of this rule v is the speed half a step before q, so that forces by q alone are of second order.
Centrifugal forces and those at T are taken at v + h a / 2, a of the step before; the engine takes
them at v, which is of first order: at large amplitudes that gives back energy which the beam lost,
and T is 1.3 mm off in 8 s near its resonance, sixty times as much (`benchmarks/integrators.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import ActuatorColumn
from workbench.sim.chain_acceleration import hinge_gains, root_gains, sum_inertias
from workbench.sim.chain_friction import FRICTION_WORK, begin_to_rub, rub
from workbench.sim.chain_links import (
    COS,
    LOSS,
    RX,
    RZ,
    SIN,
    TORQUE,
    WORK,
    bend_hinges,
    compile_part,
    place_links,
    pull_top,
    read_coordinates,
    read_rates,
)
from workbench.sim.compiling import compiled
from workbench.sim.droop_ripple import ripple, servo_rate
from workbench.sim.ground import planar_forces, planar_forces_again

__all__ = ["step_chains"]

Array = NDArray[np.float64]

_HIGHEST = 1e10
"""Above it an acceleration has diverged (the engine's mjMAXVAL)."""

_OF, _GAIN, _OFFSET, _STIFFNESS, _DAMPING, _ADDRESS, _MODULATED, _RIPPLED, _DROOP = map(
    int, ActuatorColumn
)


def _step_chains(
    links: Array,
    actuators: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: Array,
    ahead: Array,
    root: int,
    rows: NDArray[np.int32],
    state: Array,
    forced: Array,
    spans: NDArray[np.int64],
    steps: int,
    torque: Array,
    broken: NDArray[np.bool_],
    bodies: Array,
    xpos: Array,
    xmat: Array,
    xanchor: Array,
) -> None:
    """Step some simulations of equal layout in place; one that diverges keeps its last state.

    Args:
        links: (s, n + 1, 15) of `PlanarChain` [SI], as all that follows up to the step, stacked.
        actuators: (s, nu, 13) [SI].
        ground: (s, 18) [SI].
        laws: (s, 10) [SI].
        top: (s, 4) [m, rad].
        gravity: (s, 2) [m/s^2].
        step: (s,) [s].
        ahead: (s,) [s].
        root: degrees of freedom of the root.
        rows: (r,) of the simulations to step.
        state: (s, size) mjSTATE_INTEGRATION [SI].
        forced: (s, size) states of which `userdata` has the forces [SI]; a state that was corrected
            since then gets new ones.
        spans: (7, 2) begin and end of qpos, qvel, act, ctrl, userdata, time and acceleration in the
            state; that of the last step, whose place in the engine is `qacc_warmstart`.
        steps: how many.
        torque: (s, nu) of the last step's actuators, written [N m].
        broken: (s,) set where an acceleration diverged; those are not stepped again.
        bodies: (s, nbody, 4) of `PlanarChain` [m, rad].
        xpos: (s, nbody, 3) positions of the bodies after the steps, as all that follows written
            where the motion changes them [m].
        xmat: (s, nbody, 9) axes of the bodies [1].
        xanchor: (s, njnt, 3) of hinges [m].
    """
    count = links.shape[1] + 2
    q, v, a, foot = np.empty(count), np.empty(count), np.empty(count), np.empty(3)
    later = np.empty(count)
    act, user = np.empty(spans[2, 1] - spans[2, 0]), np.empty(spans[4, 1] - spans[4, 0])
    work, friction = np.empty((links.shape[1], WORK)), np.empty((links.shape[1], FRICTION_WORK))
    for row in rows:
        if broken[row]:
            continue
        qpos, qvel = _slice(state, row, spans[0]), _slice(state, row, spans[1])
        control, unchanged = _slice(state, row, spans[3]), True
        for k in (0, 1, 4):
            for i in range(spans[k, 0], spans[k, 1]):
                unchanged = unchanged and state[row, i] == forced[row, i]
        acceleration = _slice(state, row, spans[6])
        read_coordinates(root, qpos, q)
        read_rates(root, qvel, v)
        read_rates(root, acceleration, a)
        _copy(_slice(state, row, spans[2]), act)
        _copy(_slice(state, row, spans[4]), user)
        broken[row] = not _step_chain(
            links[row], actuators[row], ground[row], laws[row], top[row], gravity[row],
            float(step[row]), float(ahead[row]), root > 0, q, v, a, later, act, control, user,
            unchanged, steps, torque[row], foot, work, friction,
        )  # fmt: skip
        if broken[row]:
            continue
        _write_coordinates(root, q, qpos)
        _write_rates(root, v, qvel)
        _write_rates(root, a, acceleration)
        _copy(act, _slice(state, row, spans[2]))
        _copy(user, _slice(state, row, spans[4]))
        state[row, spans[5, 0]] += steps * step[row]
        place_links(links[row], q, v, work)
        _write_poses(bodies[row], root, q, work, xpos[row], xmat[row], xanchor[row])


@compile_part
def _write_poses(
    bodies: Array, root: int, q: Array, work: Array, xpos: Array, xmat: Array, xanchor: Array
) -> None:
    """Write positions and orientations of bodies and positions of hinges."""
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
def _slice(state: Array, row: int, span: NDArray[np.int64]) -> Array:
    return state[row, span[0] : span[1]]


@compile_part
def _copy(values: Array, to: Array) -> None:
    for i in range(len(values)):
        to[i] = values[i]


@compile_part
def _write_coordinates(root: int, q: Array, qpos: Array) -> None:
    """Copy a chain's coordinates to the engine's; the reverse of `read_coordinates`."""
    if root == 6:
        qpos[0], qpos[2] = q[0], q[1]
        qpos[3], qpos[5] = math.cos(q[2] / 2), math.sin(q[2] / 2)
    angles = len(qpos) - len(q)
    for i in range(3 if root == 6 else 3 - root, len(q)):
        qpos[angles + i] = q[i]


@compile_part
def _write_rates(root: int, v: Array, qvel: Array) -> None:
    """Copy rates of a chain's coordinates to the engine's; the reverse of `read_rates`."""
    if root == 6:
        qvel[0], qvel[2], qvel[4] = v[0], v[1], v[2]
    speeds = len(qvel) - len(v)
    for i in range(3 if root == 6 else 3 - root, len(v)):
        qvel[speeds + i] = v[i]


@compile_part
def _step_chain(
    links: Array,
    actuators: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: float,
    ahead: float,
    free: bool,
    q: Array,
    v: Array,
    a: Array,
    later: Array,
    act: Array,
    control: Array,
    user: Array,
    unchanged: bool,
    steps: int,
    torque: Array,
    foot: Array,
    work: Array,
    friction: Array,
) -> bool:
    """Step one chain; return whether every acceleration was finite."""
    last = links.shape[0] - 1
    rubs = begin_to_rub(links, v, friction)
    for done in range(steps):
        foot[0] = foot[1] = foot[2] = 0.0
        if ground[0] != 0.0:
            if unchanged and done == 0:
                planar_forces_again(ground, q, user, foot)
            else:
                planar_forces(ground, q, v, user, foot)
        for i in range(last + 3):
            later[i] = v[i] + ahead * a[i]
        place_links(links, q, later, work)
        bend_hinges(links, q, v, work)
        for i in range(actuators.shape[0]):
            _add_actuator_torque(actuators, i, q, v, act, control, torque, work)
        if laws[0] != 0.0:
            pull_top(links, laws, top, q, later, work)
        if rubs:
            rub(links, gravity, free, v, foot, work, friction)
        sum_inertias(links, step, work)
        turn, forward, up = root_gains(work, foot) if free else (0.0, -gravity[0], -gravity[1])
        if not abs(turn) + abs(forward) + abs(up) < _HIGHEST:
            return False
        if free:
            a[0], a[1], a[2] = forward + gravity[0], up + gravity[1], turn
        for i in range(actuators.shape[0]):
            _step_activation(actuators, i, step, q, v, act, control, work)
        for k in range(1, last + 1):
            joint, forward, up = hinge_gains(work, k, turn, forward, up)
            if not abs(joint) < _HIGHEST:
                return False
            turn += joint
            a[2 + k] = joint
        for i in range(0 if free else 3, last + 3):
            v[i] += step * a[i]
            q[i] += step * v[i]
    return True


@compile_part
def _add_actuator_torque(
    actuators: Array,
    i: int,
    q: Array,
    v: Array,
    act: Array,
    control: Array,
    torque: Array,
    work: Array,
) -> None:
    """Add the torque of an actuator to that of its hinge."""
    k, gain, address = int(actuators[i, _OF]), actuators[i, _GAIN], int(actuators[i, _ADDRESS])
    if actuators[i, _RIPPLED] != 0.0:
        gain *= ripple(actuators[i, _DROOP + 1 :], work[k, COS], work[k, SIN])
    driven = control[i] if address < 0 else act[address]
    passive = actuators[i, _STIFFNESS] * q[2 + k] + actuators[i, _DAMPING] * v[2 + k]
    torque[i] = gain * driven + actuators[i, _OFFSET] + passive
    work[k, TORQUE] += torque[i]
    work[k, LOSS] -= actuators[i, _DAMPING]


@compile_part
def _step_activation(
    actuators: Array,
    i: int,
    step: float,
    q: Array,
    v: Array,
    act: Array,
    control: Array,
    work: Array,
) -> None:
    """Integrate an actuator's activation, with the hinges' speeds before the step."""
    k, address, rate = int(actuators[i, _OF]), int(actuators[i, _ADDRESS]), control[i]
    if address < 0:
        return
    if actuators[i, _MODULATED] != 0.0:
        error, numbers = act[address] - q[2 + k], actuators[i, _DROOP:]
        rate = servo_rate(numbers, rate, error, v[2 + k], work[k, COS], work[k, SIN])
    act[address] += step * rate


step_chains: Callable[..., None] = compiled(_step_chains)
