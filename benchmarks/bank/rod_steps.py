"""Dormand-Prince 5(4) with error control, samples by Hermite's cubic, and contact events.

Coefficients: J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, 1980.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.bank.rod_constants import Constants
from benchmarks.bank.rod_contact import event, ground_forces, mark, switch
from benchmarks.bank.rod_equations import motor_command, rates
from benchmarks.bank.rod_laws import Work
from benchmarks.bank.rod_mesh import Mesh

__all__ = ["FELL", "integrate"]

Array = NDArray[np.float64]

FELL = 0.05
"""Height of T [m] below which the robot has fallen and the samples end."""

_C = np.array([0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1])
_A = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_E = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
_STAGES = 7
_LEAST_S, _FIRST_S, _MOST_S = 1e-9, 1e-5, 4e-3
_BISECTIONS = 30
_RATE_SCALE = 30.0  # errors of rates count as much less than those of places [1/s]


@numba.njit(cache=True)
def _derive(
    m: Mesh, k: Constants, w: Work, points: Array, y: Array, dy: Array, strives: float,
    t: float, first: int, ground: Array,
) -> None:  # fmt: skip
    size = len(w.force)
    if first == 0:
        ground_forces(points, k, y[:3], y[size : size + 3], ground)
    rates(m, k, y, dy, w, ground, strives, t, first)


@numba.njit(cache=True)
def _attempt(
    m: Mesh, k: Constants, w: Work, points: Array, y: Array, stages: Array, new: Array,
    strives: float, t: float, h: float, first: int, ground: Array,
) -> None:  # fmt: skip
    """Fill stages 1 to 6 and the new state; stage 0 holds the rates at the start."""
    for i in range(1, _STAGES):
        for a in range(len(y)):
            total = 0.0
            for b in range(i):
                total += _A[i, b] * stages[b, a]
            new[a] = y[a] + h * total
        _derive(m, k, w, points, new, stages[i], strives, t + _C[i] * h, first, ground)


@numba.njit(cache=True)
def _error(y: Array, new: Array, stages: Array, h: float, size: int, tolerance: float) -> float:
    """Return the error of a step over what is allowed, root mean square."""
    total = 0.0
    for a in range(len(y)):
        off = 0.0
        for i in range(_STAGES):
            off += _E[i] * stages[i, a]
        allowed = tolerance * (1.0 + max(abs(y[a]), abs(new[a])))
        if size <= a < 2 * size:
            allowed *= _RATE_SCALE
        total += (h * off / allowed) ** 2
    return np.sqrt(total / len(y))


@numba.njit(cache=True)
def _between(
    y: Array, new: Array, start: Array, end: Array, h: float, part: float, out: Array
) -> None:
    """Write Hermite's cubic at a part of the step."""
    a, b = part * part * (3 - 2 * part), part * (1 - part) * (1 - part) * h
    c = -part * part * (1 - part) * h
    for i in range(len(out)):
        out[i] = y[i] + a * (new[i] - y[i]) + b * start[i] + c * end[i]


@numba.njit(cache=True)
def _first_event(
    points: Array, k: Constants, y: Array, new: Array, stages: Array, h: float, size: int,
    slid: Array, at: Array,
) -> tuple[int, float]:  # fmt: skip
    """Return which point changes first and at which part of the step; -1 where none does."""
    which, earliest = -1, 1.0
    for i in range(len(points)):
        if event(points[i], k, new[:3], new[size : size + 3], slid[i]) <= 0.0:
            continue
        low, high = 0.0, earliest
        _between(y, new, stages[0], stages[6], h, high, at)
        if which >= 0 and event(points[i], k, at[:3], at[size : size + 3], slid[i]) <= 0.0:
            continue
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            _between(y, new, stages[0], stages[6], h, middle, at)
            if event(points[i], k, at[:3], at[size : size + 3], slid[i]) > 0.0:
                high = middle
            else:
                low = middle
        which, earliest = i, high
    return which, earliest


@numba.njit(cache=True)
def integrate(
    m: Mesh, k: Constants, w: Work, points: Array, y: Array, samples: Array,
    times: Array, speeds: Array, first: int, tolerance: float,
) -> tuple[Array, int, int]:  # fmt: skip
    """Return states at the samples, how many were reached, and the number of steps.

    Args:
        m: the strip.
        k: the robot.
        w: arrays to work in.
        points: (c, 6) contact points, changed as they touch, slide and hold.
        y: (s,) state at the first sample, changed.
        samples: (n,) times [s].
        times: (j,) at which the motor's command changes [s]; no step crosses one.
        speeds: (j,) from then on [rad/s].
        first: moving coordinate, 3 for a clamped foot and 0 for a free one.
        tolerance: of a step [m, rad]; of rates thirty times as much a second.
    """
    size, top = len(w.force), len(m.mass)
    stages, new, at = np.zeros((_STAGES, len(y))), y.copy(), y.copy()
    ground, slid = np.zeros(3), np.zeros(len(points))
    kept = np.empty((len(samples), len(y)))
    kept[0] = y
    t, h, done, steps = samples[0], _FIRST_S, 1, 0
    strives = motor_command(k, times, speeds, t)
    _derive(m, k, w, points, y, stages[0], strives, t, first, ground)
    while done < len(samples):
        upcoming = np.searchsorted(times, t + _LEAST_S, side="right")
        stop = min(samples[-1], times[upcoming]) if upcoming < len(times) else samples[-1]
        reaches = t + h >= stop - _LEAST_S
        taken = stop - t if reaches else h
        strives = motor_command(k, times, speeds, t + 0.5 * taken)
        _attempt(m, k, w, points, y, stages, new, strives, t, taken, first, ground)
        steps += 1
        error = _error(y, new, stages, taken, size, tolerance)
        if not np.isfinite(error) or h < _LEAST_S:
            return kept, done, steps
        if error > 1.0:
            h = taken * max(0.2, 0.9 * error**-0.2)
            continue
        which = -1
        if first == 0:
            which, part = _first_event(points, k, y, new, stages, taken, size, slid, at)
            if which >= 0:
                taken, reaches = taken * part, False
                _attempt(m, k, w, points, y, stages, new, strives, t, taken, first, ground)
        while done < len(samples) and samples[done] <= t + taken + 1e-12:
            part = min(1.0, (samples[done] - t) / taken)
            _between(y, new, stages[0], stages[6], taken, part, kept[done])
            done += 1
        t = stop if reaches else t + taken
        y[:] = new
        stages[0] = stages[6]
        if w.place_z[top] < FELL:
            return kept, done, steps
        if which < 0 and not reaches:
            h = min(_MOST_S, taken * min(5.0, 0.9 * max(error, 1e-8) ** -0.2))
        if first == 0:
            mark(points, k, y[:3], y[size : size + 3], slid)
        if which >= 0:
            switch(points[which], k, y[:3], y[size : size + 3])
            slid[which] = 0.0
        if which >= 0 or reaches:
            strives = motor_command(k, times, speeds, t + _LEAST_S)
            _derive(m, k, w, points, y, stages[0], strives, t, first, ground)
    return kept, done, steps
