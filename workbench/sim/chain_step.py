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
from workbench.sim.chain_acceleration import accelerate_hinges, accelerate_root, sum_inertias
from workbench.sim.chain_friction import begin_to_rub, rub
from workbench.sim.chain_links import (
    ACCELERATION,
    COS,
    FORWARD,
    LANES,
    LATER,
    LOSS,
    RX,
    RZ,
    SIN,
    TORQUE,
    TURN,
    UP,
    Q,
    V,
    bend_hinges,
    compile_part,
    place_links,
    pull_top,
    read_coordinates,
    read_hinges,
    read_rates,
)
from workbench.sim.compiling import compiled
from workbench.sim.droop_ripple import ripple, servo_rate
from workbench.sim.ground import planar_forces, planar_forces_again

__all__ = ["step_chains"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_HIGHEST = 1e10
"""Above it an acceleration has diverged (the engine's mjMAXVAL)."""

_OF, _GAIN, _OFFSET, _STIFFNESS, _DAMPING, _ADDRESS, _MODULATED, _RIPPLED, _DROOP = map(
    int, ActuatorColumn
)


def _step_chains(
    blocks: Array,
    actuators: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: Array,
    ahead: Array,
    root: int,
    asked: Flags,
    state: Array,
    forced: Array,
    spans: NDArray[np.int64],
    steps: int,
    torque: Array,
    broken: Flags,
    bodies: Array,
    xpos: Array,
    xmat: Array,
    xanchor: Array,
) -> None:
    """Step some simulations of equal layout in place; one that diverges keeps its last state.

    Args:
        blocks: (b, n + 1, ROW) of `blocks_of` with the links of all simulations [SI].
        actuators: (s, nu, 13) of `PlanarChain` [SI], as all that follows up to the step, stacked.
        ground: (s, 18) [SI].
        laws: (s, 10) [SI].
        top: (s, 4) [m, rad].
        gravity: (s, 2) [m/s^2].
        step: (s,) [s].
        ahead: (s,) [s].
        root: degrees of freedom of the root.
        asked: (s,) which simulations are stepped.
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
    values, scratch = np.empty(blocks.shape[1] + 2), np.empty(blocks.shape[1:])
    feet, rates, gains = np.empty((LANES, 3)), np.empty((LANES, 3)), np.empty((LANES, 3))
    act = np.empty((LANES, spans[2, 1] - spans[2, 0]))
    control = np.empty((LANES, spans[3, 1] - spans[3, 0]))
    user = np.empty((LANES, spans[4, 1] - spans[4, 0]))
    failed, unchanged = np.empty(LANES, dtype=np.bool_), np.empty(LANES, dtype=np.bool_)
    none = np.zeros(LANES)
    for b in range(len(blocks)):
        block, first = blocks[b], LANES * b
        lanes, stepped = min(LANES, len(state) - first), 0
        for i in range(lanes):
            row = first + i
            failed[i] = broken[row] or not asked[row]
            unchanged[i] = ground[row, 0] != 0.0 and _is_same(state, forced, row, spans)
            read_coordinates(root, _slice(state, row, spans[0]), values)
            read_hinges(values, Q, i, block, feet)
            read_rates(root, _slice(state, row, spans[1]), values)
            read_hinges(values, V, i, block, rates)
            read_rates(root, _slice(state, row, spans[6]), values)
            read_hinges(values, ACCELERATION, i, block, gains)
            _read(state, row, spans[2, 0], act, i)
            _read(state, row, spans[3, 0], control, i)
            _read(state, row, spans[4, 0], user, i)
            stepped += not failed[i]
        if stepped == 0:
            continue
        own = slice(first, first + lanes)
        _step_block(
            block, scratch, actuators[own], ground[own], laws[own], top[own], gravity[own],
            step[own], ahead[own], root > 0, feet, rates, gains, act, control, user, unchanged,
            steps, torque[own], failed,
        )  # fmt: skip
        _look_ahead(block, none, lanes)  # poses are of the state itself
        place_links(block, feet, rates, lanes)
        for i in range(lanes):
            row = first + i
            if failed[i]:
                broken[row] = broken[row] or asked[row]
                continue
            _gather(block, Q, i, feet, values)
            _write_coordinates(root, values, _slice(state, row, spans[0]))
            _gather(block, V, i, rates, values)
            _write_rates(root, values, _slice(state, row, spans[1]))
            _gather(block, ACCELERATION, i, gains, values)
            _write_rates(root, values, _slice(state, row, spans[6]))
            _write(state, row, spans[2, 0], act, i)
            _write(state, row, spans[4, 0], user, i)
            state[row, spans[5, 0]] += steps * step[row]
            _write_poses(bodies, root, row, i, feet, block, xpos, xmat, xanchor)


@compile_part
def _is_same(state: Array, forced: Array, row: int, spans: NDArray[np.int64]) -> bool:
    """Return whether a state's coordinates, rates and corners are those that have forces."""
    for k in (0, 1, 4):
        for i in range(spans[k, 0], spans[k, 1]):
            if state[row, i] != forced[row, i]:
                return False
    return True


@compile_part
def _read(state: Array, row: int, begin: int, part: Array, lane: int) -> None:
    """Copy a part of a state to a chain's lane."""
    for j in range(part.shape[1]):
        part[lane, j] = state[row, begin + j]


@compile_part
def _write(state: Array, row: int, begin: int, part: Array, lane: int) -> None:
    """Copy a part of a state back from a chain's lane."""
    for j in range(part.shape[1]):
        state[row, begin + j] = part[lane, j]


@compile_part
def _gather(block: Array, column: int, lane: int, of_root: Array, values: Array) -> None:
    """Copy coordinates, rates or accelerations of one chain; the reverse of `read_hinges`."""
    for i in range(3):
        values[i] = of_root[lane, i]
    for k in range(1, len(block)):
        values[2 + k] = block[k, column + lane]


@compile_part
def _write_poses(
    bodies: Array, root: int, row: int, lane: int, feet: Array, block: Array, xpos: Array,
    xmat: Array, xanchor: Array,
) -> None:  # fmt: skip
    """Write positions and orientations of a chain's bodies and positions of its hinges."""
    x, z, body = feet[lane, 0], feet[lane, 1], 1
    first = xanchor.shape[1] - len(block) + 1
    for k in range(len(block)):
        if k > 0:
            x, z = x + block[k, RX + lane], z + block[k, RZ + lane]
        if k > 0 or root > 0:
            xanchor[row, first + k - 1, 0], xanchor[row, first + k - 1, 2] = x, z
        c, s = block[k, COS + lane], block[k, SIN + lane]
        while body < bodies.shape[1] and bodies[row, body, 0] == k:
            dx, dz, turn = bodies[row, body, 1], bodies[row, body, 2], bodies[row, body, 3]
            xpos[row, body, 0], xpos[row, body, 2] = x + c * dx + s * dz, z + c * dz - s * dx
            a, b = c, s
            if turn != 0.0:
                a = c * math.cos(turn) - s * math.sin(turn)
                b = s * math.cos(turn) + c * math.sin(turn)
            xmat[row, body, 0], xmat[row, body, 2] = a, b
            xmat[row, body, 6], xmat[row, body, 8] = -b, a
            body += 1


@compile_part
def _slice(state: Array, row: int, span: NDArray[np.int64]) -> Array:
    return state[row, span[0] : span[1]]


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
def _step_block(
    block: Array,
    scratch: Array,
    actuators: Array,
    ground: Array,
    laws: Array,
    top: Array,
    gravity: Array,
    step: Array,
    ahead: Array,
    free: bool,
    feet: Array,
    rates: Array,
    gains: Array,
    act: Array,
    control: Array,
    user: Array,
    unchanged: Flags,
    steps: int,
    torque: Array,
    failed: Flags,
) -> None:
    """Step the chains of a block; say of which an acceleration was not finite."""
    lanes = len(step)
    rubs = begin_to_rub(block, scratch, lanes)
    pushed, later = np.zeros((LANES, 3)), np.zeros((LANES, 3))
    for done in range(steps):
        for i in range(lanes):
            pushed[i, 0] = pushed[i, 1] = pushed[i, 2] = 0.0
            if ground[i, 0] != 0.0:
                if unchanged[i] and done == 0:
                    planar_forces_again(ground[i], feet[i], user[i], pushed[i])
                else:
                    planar_forces(ground[i], feet[i], rates[i], user[i], pushed[i])
            for j in range(3):
                later[i, j] = rates[i, j] + ahead[i] * gains[i, j]
        _look_ahead(block, ahead, lanes)
        place_links(block, feet, later, lanes)
        bend_hinges(block, lanes)
        _drive(actuators, act, control, block, torque, failed)
        for i in range(lanes):
            if laws[i, 0] != 0.0:
                pull_top(block, i, laws[i], top[i], feet[i, 0])
        if rubs:
            rub(block, scratch, gravity, free, pushed, failed, lanes)
        sum_inertias(block, step, lanes)
        accelerate_root(block, gravity, free, pushed, lanes)
        _activate(actuators, step, act, control, block, lanes)
        accelerate_hinges(block, lanes)
        _integrate(block, step, lanes)
        if free:
            _integrate_root(block, gravity, step, feet, rates, gains, lanes)
        if _find_failed(block, failed, lanes) == lanes:
            return


@compile_part
def _look_ahead(block: Array, ahead: Array, lanes: int) -> None:
    """Write at what speeds of hinges centrifugal forces are taken."""
    for k in range(1, len(block)):
        for i in range(lanes):
            block[k, LATER + i] = block[k, V + i] + ahead[i] * block[k, ACCELERATION + i]


@compile_part
def _integrate(block: Array, step: Array, lanes: int) -> None:
    """Integrate the hinges' speeds and, with the new ones, their angles."""
    for k in range(1, len(block)):
        for i in range(lanes):
            speed = block[k, V + i] + step[i] * block[k, ACCELERATION + i]
            block[k, V + i] = speed
            block[k, Q + i] += step[i] * speed


@compile_part
def _integrate_root(
    block: Array, gravity: Array, step: Array, feet: Array, rates: Array, gains: Array, lanes: int
) -> None:
    """Integrate the roots' motion, and write their accelerations."""
    for i in range(lanes):
        gains[i, 0] = block[0, FORWARD + i] + gravity[i, 0]
        gains[i, 1] = block[0, UP + i] + gravity[i, 1]
        gains[i, 2] = block[0, TURN + i]
        for j in range(3):
            rates[i, j] += step[i] * gains[i, j]
            feet[i, j] += step[i] * rates[i, j]


@compile_part
def _find_failed(block: Array, failed: Flags, lanes: int) -> int:
    """Write which chains have an acceleration that has diverged, and return how many."""
    count = 0
    for i in range(lanes):
        total = abs(block[0, TURN + i]) + abs(block[0, FORWARD + i]) + abs(block[0, UP + i])
        for k in range(1, len(block)):
            total += abs(block[k, ACCELERATION + i])
        failed[i] = failed[i] or not total < _HIGHEST
        count += failed[i]
    return count


@compile_part
def _drive(
    actuators: Array, act: Array, control: Array, block: Array, torque: Array, failed: Flags
) -> None:
    """Write the torques of actuators and add them to those of their hinges."""
    for i in range(len(actuators)):
        for j in range(actuators.shape[1]):
            k, gain = int(actuators[i, j, _OF]), actuators[i, j, _GAIN]
            address, damping = int(actuators[i, j, _ADDRESS]), actuators[i, j, _DAMPING]
            if actuators[i, j, _RIPPLED] != 0.0:
                shares = actuators[i, j, _DROOP + 1 :]
                gain *= ripple(shares, block[k, COS + i], block[k, SIN + i])
            driven = control[i, j] if address < 0 else act[i, address]
            stiffness = actuators[i, j, _STIFFNESS]
            passive = stiffness * block[k, Q + i] + damping * block[k, V + i]
            total = gain * driven + actuators[i, j, _OFFSET] + passive
            block[k, TORQUE + i] += total
            block[k, LOSS + i] -= damping
            if not failed[i]:
                torque[i, j] = total


@compile_part
def _activate(
    actuators: Array, step: Array, act: Array, control: Array, block: Array, lanes: int
) -> None:
    """Integrate the actuators' activations, with the hinges' speeds before the step."""
    for i in range(lanes):
        for j in range(actuators.shape[1]):
            k, address = int(actuators[i, j, _OF]), int(actuators[i, j, _ADDRESS])
            if address < 0:
                continue
            rate = control[i, j]
            if actuators[i, j, _MODULATED] != 0.0:
                error, speed = act[i, address] - block[k, Q + i], block[k, V + i]
                c, s = block[k, COS + i], block[k, SIN + i]
                rate = servo_rate(actuators[i, j, _DROOP:], rate, error, speed, c, s)
            act[i, address] += step[i] * rate


step_chains: Callable[..., None] = compiled(_step_chains)
