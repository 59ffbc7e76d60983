"""The ground law solved by events: sticking is an exact constraint, every change of state located.

Each edge of the foot stands for two corners. Its normal force is eq. 3.1 and 3.2 of the thesis; its
friction is set-valued where it rests and follows one of the readings of figure 3.4 where it moves.
Between events Runge and Kutta's fourth order with a fixed step; an event ends a step where it is.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.contact.chain import Chain, factor, forces, mass_matrix, solve

__all__ = [
    "AIR",
    "BELOW",
    "FAST",
    "READINGS",
    "SLOW",
    "STICK",
    "TOUCH",
    "Name",
    "Reading",
    "Run",
    "Start",
    "solve_events",
]

Array = NDArray[np.float64]

AIR, BELOW, TOUCH = 0, 1, 2
"""Above the floor; below it without a force, as eq. 3.1 has one that only pushes; with a force."""
STICK, WAIT, SLOW, FAST = 0, 1, 2, 3
"""Held, held although its load is too much, slides slower than v_th, slides faster."""
EDGES = 2
_ZERO_SPEED = 1e-9  # [m/s] an edge that is slower rests
_SLACK = 1e-10  # [N] of a limit
_HALVINGS = 44
_CROWD = 200


class Reading(NamedTuple):
    """What the law leaves open, as numbers for compiled code.

    Args:
        wait: 0: static friction against the motion up to the threshold speed; 1: sliding friction
            as soon as an edge breaks loose; 2: held until the speed that it would have if it were
            free exceeds the threshold.
        lock: 0: friction brings an edge to rest; 1: an edge slower than the threshold is stopped at
            once, where static friction could hold it (always, with wait 2).
        split: 0: two edges at rest each hold their own place, exactly; 1: the foot is held as one
            and both take the same share, the least of all norms.
        ramp: depth over which the normal damping grows in at a landing [m]; zero as printed.
    """

    wait: int
    lock: int
    split: int
    ramp: float = 0.0


Name = Literal[
    "slides", "slides, shared", "slides, shared, stopped", "slides, soft landing",
    "static below v_th", "static, shared, stopped", "held until faster",
]  # fmt: skip

READINGS: dict[Name, Reading] = {
    "slides": Reading(1, 0, 0),
    "slides, shared": Reading(1, 0, 1),
    "slides, shared, stopped": Reading(1, 1, 1),
    "slides, soft landing": Reading(1, 0, 0, 5e-4),
    "static below v_th": Reading(0, 0, 0),
    "static, shared, stopped": Reading(0, 1, 1),
    "held until faster": Reading(2, 1, 1),
}
"""The first one is the twin's."""


class Start(NamedTuple):
    """A state to start from.

    Args:
        q: coordinates of `chain`.
        v: their rates.
        act: commanded angle of the rotor [rad].
        touch: (2,) of the front and the rear edge.
        grip: (2,) of the same.
        sign: (2,) of the same: which way it slides.
    """

    q: Array
    v: Array
    act: float
    touch: Array
    grip: Array
    sign: Array


class Run(NamedTuple):
    """What came of it.

    Args:
        foot: (n, 3) x, z [m] and pitch [rad] of its centre, at 120 Hz; NaN from where changes of
            state follow one another without end.
        events: number of changes of state.
        stopped: energy that stopping edges at once took [J].
    """

    foot: Array
    events: int
    stopped: float


def solve_events(
    c: Chain, r: Reading, start: Start, omega: float, seconds: float, steps: int
) -> Run:
    """Follow a robot whose rotor turns at a constant speed.

    Args:
        c: the robot.
        r: reading of the law.
        start: state at time zero.
        omega: commanded speed [rad/s].
        seconds: how long.
        steps: from one sample to the next; 100 are stable for the thesis' beam, 60 are not.
    """
    touch, grip, sign = (np.array(a, dtype=float) for a in (start.touch, start.grip, start.sign))
    drive, count = np.array([start.act, omega]), round(120 * seconds) + 1
    step = 1 / 120 / steps
    return Run(*_follow(c, r, start.q, start.v, drive, touch, grip, sign, count, steps, step))


@numba.njit(cache=True)
def _normal(c: Chain, r: Reading, z: float, vz: float) -> float:
    damping = c.normal[1]
    if r.ramp > 0.0:
        damping *= min(1.0, max(0.0, -z / r.ramp))
    return -c.normal[0] * z - damping * vz


@numba.njit(cache=True)
def _edge(
    c: Chain, r: Reading, q: Array, v: Array, touch: Array, e: int
) -> tuple[float, float, float, float, float]:
    """Return arm x, friction's arm z, height, forward and upward speed of an edge, front first."""
    b = c.half if e == 0 else -c.half
    ax, az = np.cos(q[2]) * b, -np.sin(q[2]) * b
    low = 0.0 if r.split == 1 and touch[0] == TOUCH and touch[1] == TOUCH else az
    return ax, low, q[1] + az, v[0] + v[2] * low, v[1] - v[2] * ax


@numba.njit(cache=True)
def _hold(r: Reading, b: Array, g: Array, force: Array, held: Array) -> None:
    """Write the forces of edges that are held, the others' being given."""
    if held[0] and held[1]:
        det = g[0, 0] * g[1, 1] - g[0, 1] * g[1, 0]
        if det < 1e-12 * g[0, 0] * g[1, 1]:
            both = -2.0 * (b[0] + b[1]) / (g[0, 0] + g[0, 1] + g[1, 0] + g[1, 1])
            force[0] = force[1] = 0.5 * both
        else:
            force[0] = (-b[0] * g[1, 1] + b[1] * g[0, 1]) / det
            force[1] = (-b[1] * g[0, 0] + b[0] * g[1, 0]) / det
        return
    for e in range(EDGES):
        if held[e]:
            o = 1 - e
            force[e] = -(b[e] + g[e, o] * force[o]) / g[e, e]


@numba.njit(cache=True)
def _coefficient(c: Chain, r: Reading, grip: int) -> float:
    return c.friction[1] if grip == SLOW and r.wait == 0 else c.friction[0]


@numba.njit(cache=True)
def _friction(
    c: Chain, r: Reading, b: Array, g: Array, fz: Array, touch: Array, grip: Array, sign: Array,
    force: Array,
) -> None:  # fmt: skip
    """Write the forward force of each edge."""
    held = np.zeros(EDGES)
    for e in range(EDGES):
        force[e] = 0.0
        if touch[e] == TOUCH and grip[e] > WAIT:
            force[e] = -sign[e] * _coefficient(c, r, grip[e]) * max(fz[e], 0.0)
        elif touch[e] == TOUCH:
            held[e] = 1.0
    _hold(r, b, g, force, held)


@numba.njit(cache=True)
def _kinetics(
    c: Chain, r: Reading, y: Array, t: float, drive: Array, touch: Array,
    m: Array, free: Array, w: Array, b: Array, g: Array, fz: Array,
) -> None:  # fmt: skip
    """Write what friction needs: free acceleration, edges' responses, their accelerations, (2, 2).

    `w` (2, n) are accelerations by a unit forward force at an edge, `g` (2, 2) the edges' own, `b`
    (2,) theirs without friction, `fz` (2,) the normal forces.
    """
    n = len(free)
    q, v = y[:n], y[n : 2 * n]
    mass_matrix(c, q, m)
    factor(m)
    forces(c, q, v, drive[0] + drive[1] * t, drive[1], free)
    for e in range(EDGES):
        ax, az, z, _, vz = _edge(c, r, q, v, touch, e)
        fz[e] = _normal(c, r, z, vz) if touch[e] == TOUCH else 0.0
        free[1] += fz[e]
        free[2] -= ax * fz[e]
        w[e, :] = 0.0
        w[e, 0], w[e, 2] = 1.0, az
        solve(m, w[e])
    solve(m, free)
    for e in range(EDGES):
        ax, az, _, _, _ = _edge(c, r, q, v, touch, e)
        b[e] = free[0]
        if r.split == 0 or touch[1 - e] != TOUCH:
            b[e] += az * free[2] - ax * v[2] ** 2
        for o in range(EDGES):
            g[e, o] = w[o, 0] + az * w[o, 2]


@numba.njit(cache=True)
def _rates(
    c: Chain, r: Reading, y: Array, t: float, drive: Array, touch: Array, grip: Array, sign: Array,
    m: Array, w: Array, b: Array, g: Array, fz: Array, force: Array, dy: Array,
) -> None:  # fmt: skip
    n = len(c.first) + 2
    a = dy[n : 2 * n]
    _kinetics(c, r, y, t, drive, touch, m, a, w, b, g, fz)
    _friction(c, r, b, g, fz, touch, grip, sign, force)
    for e in range(EDGES):
        for k in range(n):
            a[k] += w[e, k] * force[e]
    dy[:n] = y[n : 2 * n]
    dy[2 * n] = 0.0
    if (touch[0] == TOUCH and grip[0] == WAIT) or (touch[1] == TOUCH and grip[1] == WAIT):
        load, one = force[0] + force[1], 0 if touch[0] == TOUCH else 1
        dy[2 * n] = b[one] + g[one, one] * np.sign(load) * c.friction[0] * max(fz[0] + fz[1], 0.0)


@numba.njit(cache=True)
def _capacity(c: Chain, r: Reading, fz: Array) -> float:
    """Return the load at which a foot that rests on both edges breaks loose, shared evenly [N].

    An edge whose half exceeds its own limit gives static friction still (wait 0), sliding friction
    (1), or is held as long as the other one is (2).
    """
    low, high = max(min(fz[0], fz[1]), 0.0), max(fz[0], fz[1], 0.0)
    slide, stick = c.friction[0], c.friction[1]
    if r.wait == 0 or low == 0.0:
        return stick * (low + high)
    if r.wait == 1:
        return max(2 * stick * low, slide * low + stick * high)
    return 2 * stick * high


@numba.njit(cache=True)
def _due(
    c: Chain, r: Reading, y: Array, touch: Array, grip: Array, sign: Array, fz: Array,
    force: Array, e: int,
) -> bool:  # fmt: skip
    """Return whether an edge's state has to change."""
    n = len(c.first) + 2
    _, _, z, vx, vz = _edge(c, r, y[:n], y[n : 2 * n], touch, e)
    if touch[e] == AIR:
        return z < 0.0
    normal = _normal(c, r, z, vz)
    if touch[e] == BELOW:
        return z > 0.0 or normal > 0.0
    if normal < 0.0:
        return True
    load, limit, v_th = abs(force[e]), c.friction[1] * normal, c.friction[2]
    if r.split == 1:
        load, limit = abs(force[0] + force[1]), _capacity(c, r, fz)
    if grip[e] == STICK:
        return load > limit + _SLACK
    if grip[e] == WAIT:
        return load < limit - _SLACK or abs(y[2 * n]) > v_th
    if sign[e] * vx < -_ZERO_SPEED:
        return True
    if r.wait != 0 and r.lock == 0:
        return False
    return abs(vx) < v_th - _ZERO_SPEED if grip[e] == FAST else abs(vx) > v_th + _ZERO_SPEED


@numba.njit(cache=True)
def _stop(c: Chain, r: Reading, y: Array, touch: Array, grip: Array, w: Array, g: Array) -> float:
    """Take the edges that stick to rest by an impulse; return the energy that it takes [J]."""
    n = len(c.first) + 2
    v = y[n : 2 * n]
    speed, impulse, held = np.zeros(EDGES), np.zeros(EDGES), np.zeros(EDGES)
    for e in range(EDGES):
        held[e] = touch[e] == TOUCH and grip[e] <= WAIT
        speed[e] = _edge(c, r, y[:n], v, touch, e)[3]
    _hold(r, speed, g, impulse, held)
    taken = 0.0
    for e in range(EDGES):
        taken -= impulse[e] * speed[e]
        for k in range(n):
            v[k] += w[e, k] * impulse[e]
    for e in range(EDGES):
        taken -= impulse[e] * _edge(c, r, y[:n], v, touch, e)[3]
    return 0.5 * taken


@numba.njit(cache=True)
def _choose(
    c: Chain, r: Reading, b: Array, g: Array, fz: Array, touch: Array, grip: Array, sign: Array,
    resting: Array,
) -> None:  # fmt: skip
    """Let edges at rest stick or start to move, the first consistent choice with most at rest."""
    force, trial, way = np.zeros(EDGES), grip.copy(), sign.copy()
    for moving in range(EDGES + 1):
        for code in range(9):
            first, second = code % 3 - 1, code // 3 - 1
            if abs(first) + abs(second) != moving:
                continue
            if (first != 0 and not resting[0]) or (second != 0 and not resting[1]):
                continue
            for e in range(EDGES):
                if resting[e]:
                    s = first if e == 0 else second
                    trial[e], way[e] = (STICK if s == 0 else SLOW), float(s)
            _friction(c, r, b, g, fz, touch, trial, way, force)
            fine = True
            for e in range(EDGES):
                if resting[e]:
                    a = b[e] + g[e, 0] * force[0] + g[e, 1] * force[1]
                    if trial[e] == STICK:
                        fine &= abs(force[e]) <= c.friction[1] * fz[e] + _SLACK
                    else:
                        fine &= way[e] * a > 0.0
            if fine:
                grip[:], sign[:] = trial, way
                return
    for e in range(EDGES):  # none is consistent to the last digit: move with the load
        if resting[e]:
            grip[e] = SLOW
            sign[e] = 1.0 if b[e] > 0 else -1.0


@numba.njit(cache=True)
def _change_edges(
    c: Chain, r: Reading, y: Array, b: Array, g: Array, fz: Array, touch: Array, grip: Array,
    sign: Array, due: Array, fresh: Array,
) -> None:  # fmt: skip
    """Change the friction of edges that each hold their own place."""
    n = len(c.first) + 2
    resting = np.zeros(EDGES)
    for e in range(EDGES):
        if touch[e] != TOUCH:
            continue
        vx = _edge(c, r, y[:n], y[n : 2 * n], touch, e)[3]
        if grip[e] == STICK or (fresh[e] and abs(vx) < _ZERO_SPEED):
            resting[e] = 1.0
        elif fresh[e]:
            grip[e], sign[e] = (FAST if abs(vx) >= c.friction[2] else SLOW), np.sign(vx)
        elif due[e] and sign[e] * vx <= 0.0:
            resting[e] = 1.0
        elif due[e]:
            grip[e] = SLOW if grip[e] == FAST else FAST
    _choose(c, r, b, g, fz, touch, grip, sign, resting)


@numba.njit(cache=True)
def _change_foot(
    c: Chain, r: Reading, y: Array, b: Array, g: Array, fz: Array, touch: Array, grip: Array,
    sign: Array, due: Array, fresh: Array,
) -> None:  # fmt: skip
    """Change the friction of a foot whose edges share the load evenly and move as one."""
    n = len(c.first) + 2
    one = 0 if touch[0] == TOUCH else 1
    vx = _edge(c, r, y[:n], y[n : 2 * n], touch, one)[3]
    v_th, load, limit = c.friction[2], -b[one] / g[one, one], _capacity(c, r, fz)
    now, way, changes, landed = -1, 0.0, False, False
    for e in range(EDGES):
        if touch[e] == TOUCH:
            changes |= due[e] > 0.0
            landed |= fresh[e] > 0.0
            if fresh[e] == 0.0:
                now, way = int(grip[e]), sign[e]
    slow, rests = abs(vx) < v_th, now in (STICK, WAIT)
    breaks, would = abs(load) > limit, y[2 * n]
    if (landed and (now < 0 or now == SLOW)) or (now == FAST and changes and slow):
        stops = slow and r.lock == 1 and (r.wait == 2 or not breaks)
        rests = stops or abs(vx) < _ZERO_SPEED
        now, way = (SLOW if slow else FAST), np.sign(vx)
    elif now == SLOW and changes and not slow:
        now = FAST
    elif now > WAIT and changes and way * vx <= 0.0:
        rests = True
    if rests and breaks and r.wait != 2:
        now, way = SLOW, -np.sign(load)
    elif rests and now == WAIT and abs(would) > v_th:
        now, way = SLOW, np.sign(would)
    elif rests:
        now = WAIT if breaks else STICK
    if now != WAIT or not breaks:
        y[2 * n] = 0.0
    for e in range(EDGES):
        if touch[e] == TOUCH:
            grip[e], sign[e] = now, way


@numba.njit(cache=True)
def _change(
    c: Chain, r: Reading, y: Array, t: float, drive: Array, touch: Array, grip: Array, sign: Array,
    m: Array, w: Array, b: Array, g: Array, fz: Array, due: Array,
) -> float:  # fmt: skip
    """Change the states that are due; return the energy that stopping takes [J]."""
    n = len(c.first) + 2
    fresh, free = np.zeros(EDGES), np.zeros(n)
    for e in range(EDGES):
        _, _, z, _, vz = _edge(c, r, y[:n], y[n : 2 * n], touch, e)
        normal = _normal(c, r, z, vz)
        if due[e] and touch[e] != TOUCH:
            touch[e] = TOUCH if z <= 0.0 and normal > -_SLACK else (AIR if z > 0.0 else BELOW)
            fresh[e] = touch[e] == TOUCH
        elif due[e] and normal < 0.0:
            touch[e], grip[e] = BELOW, FAST
    _kinetics(c, r, y, t, drive, touch, m, free, w, b, g, fz)
    if r.split == 1:
        _change_foot(c, r, y, b, g, fz, touch, grip, sign, due, fresh)
    else:
        _change_edges(c, r, y, b, g, fz, touch, grip, sign, due, fresh)
    return _stop(c, r, y, touch, grip, w, g)


@numba.njit(cache=True)
def _follow(
    c: Chain, r: Reading, q: Array, v: Array, drive: Array, touch: Array, grip: Array, sign: Array,
    samples: int, every: int, h: float,
) -> tuple[Array, int, float]:  # fmt: skip
    """Return the foot at samples, the number of events and the energy of stops.

    Args:
        c: the robot.
        r: reading of the law.
        q: coordinates at time zero.
        v: their rates.
        drive: commanded angle of the rotor at time zero [rad] and speed [rad/s].
        touch: (2,) of each edge, changed.
        grip: (2,) of each edge, changed.
        sign: (2,) of each edge's sliding, changed.
        samples: how many, the first at time zero.
        every: steps from one sample to the next.
        h: step [s].
    """
    n = len(q)
    y = np.concatenate((q, v, np.zeros(1)))  # the last: speed of a foot that waits if it were free
    m, w = np.zeros((n, n)), np.zeros((EDGES, n))
    b, g, fz, force = np.zeros(EDGES), np.zeros((EDGES, EDGES)), np.zeros(EDGES), np.zeros(EDGES)
    k1, k2, k3, k4 = np.zeros_like(y), np.zeros_like(y), np.zeros_like(y), np.zeros_like(y)
    new, due = y.copy(), np.zeros(EDGES)
    kept = np.zeros((samples, 3))
    _kinetics(c, r, y, 0.0, drive, touch, m, np.zeros(n), w, b, g, fz)
    _stop(c, r, y, touch, grip, w, g)
    events, stopped = 0, 0.0
    for s in range(samples):
        kept[s] = y[:3]
        if s == samples - 1:
            break
        for i in range(every):
            begin, left, crowd = (s * every + i) * h, h, 0
            while left > 0.0:
                t = begin + h - left
                _rates(c, r, y, t, drive, touch, grip, sign, m, w, b, g, fz, force, k1)
                low, high, size = 0.0, left, left
                hit = False
                for _ in range(_HALVINGS):
                    new[:] = y + 0.5 * size * k1
                    _rates(c, r, new, t + 0.5 * size, drive, touch, grip, sign, m, w, b, g, fz,
                           force, k2)  # fmt: skip
                    new[:] = y + 0.5 * size * k2
                    _rates(c, r, new, t + 0.5 * size, drive, touch, grip, sign, m, w, b, g, fz,
                           force, k3)  # fmt: skip
                    new[:] = y + size * k3
                    _rates(c, r, new, t + size, drive, touch, grip, sign, m, w, b, g, fz, force, k4)
                    new[:] = y + size / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
                    _rates(c, r, new, t + size, drive, touch, grip, sign, m, w, b, g, fz, force, k4)
                    now = False
                    for e in range(EDGES):
                        due[e] = _due(c, r, new, touch, grip, sign, fz, force, e)
                        now |= due[e] > 0.0
                    if now:
                        hit, high = True, size
                    else:
                        low = size
                    if not hit or (now and high - low < 1e-11):
                        break
                    size = 0.5 * (low + high) if high - low > 1e-11 else high
                y[:] = new
                left = left - size if hit else 0.0
                if hit:
                    events += 1
                    crowd += 1
                    if crowd > _CROWD:  # changes without end: this reading leaves no motion
                        kept[s:] = np.nan
                        return kept, events, stopped
                    stopped += _change(c, r, y, t + size, drive, touch, grip, sign, m, w, b, g, fz,
                                       due)  # fmt: skip
    return kept, events, stopped
