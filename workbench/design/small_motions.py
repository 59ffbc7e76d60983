"""What a beam does in small motions, for many shapes at once: what hopping far hangs on.

How far a shape hops is a rough function of its 16 angles and a smooth one of these numbers: where T
and the centre of mass stand, how fast the first modes ring and which way they swing T (chapters 6
and 7 of the thesis find the good shapes' longitudinal mode near the drive). A model that learns the
distance from a few hundred hops learns it from them.

The clamped chain in absolute angles phi_j, in which the energy is short: with W_j the mass that
increment j carries, s its length and T above, V = 1/2 sum k_j (bend_j)^2 - g s sum W_j sin phi_j.
`sim.linear_modes` finds the same by the engine, one shape at a time (tests/design compare them).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.sim import parallel_map

__all__ = ["DESCRIPTORS", "SmallMotions", "Stand", "descriptors", "small_motions", "stand"]

Array = NDArray[np.float64]

Values = Mapping[str, ArrayLike]
"""Model values, SI, each a number or one for each shape, (n,)."""

_ROUNDS = 12
_LONGEST_STEP_RAD = 0.3  # of a round; a soft strip folds far
_BALANCED_RAD = 1e-12  # Newton's last step
_MODES = 3
_AT_ONCE = 200  # shapes that a thread takes
_SUBSPACE = 5  # vectors that are iterated for the slowest modes
_ITERATIONS = 8  # each shrinks the error of a mode by (omega / omega_6)^2, 0.01 of the third
_SHORTEST = 1e-9  # of a mode's reach, so that its logarithm is a number

DESCRIPTORS = (
    "tip_x", "tip_z", "centre_x", "centre_z", "rising", "falling", "third",
    "rising_cos", "rising_sin", "falling_cos", "falling_sin", "rising_reach", "falling_reach",
)  # fmt: skip
"""What each column of `descriptors` is."""


class SmallMotions(NamedTuple):
    """Small motions of n clamped shapes about their equilibrium under gravity.

    Args:
        tip: T from the foot's centre, (n, 2) x, z [m].
        centre: centre of mass of all but the foot, (n, 2) x, z [m].
        omega: natural frequencies of the slowest modes, (n, 3) [rad/s]; 0 where it would buckle.
        swing: (n, 2, 3) x and z of T in each mode of unit modal mass [kg^-0.5].
    """

    tip: Array
    centre: Array
    omega: Array
    swing: Array


class Stand(NamedTuple):
    """Where n shapes are when their robots stand on the ground; NaN where one would buckle.

    Args:
        tip_x: of T from the foot's centre, (n,) [m].
        tip_z: of T above the floor, (n,) [m].
        lowest: of the strip's joints above the foot's plane, (n,) [m].
    """

    tip_x: Array
    tip_z: Array
    lowest: Array


def small_motions(
    values: Values, angles: ArrayLike, length: float, *, standing: bool = False
) -> SmallMotions:
    """Return the small motions of shapes, the rotor a point at T.

    Args:
        values: of the model.
        angles: (n, N) [rad].
        length: of the beam [m].
        standing: whether the angles are those under gravity, else those of the free strip.
    """
    rest, step, shares, masses, weight, hinges = _chain(values, angles, length)
    count = rest.shape[1]
    moved = np.einsum("bj,nb,bk->njk", shares, masses, shares) * step**2
    inertia = np.broadcast_to(masses[:, :1] * step**2 / 12, rest.shape).copy()
    inertia[:, -1:] += _column(values, "top_mass") * step**2 / 12
    moved = np.ascontiguousarray(np.broadcast_to(moved, (len(rest), count, count)))

    def ring(at: slice) -> tuple[Array, ...]:
        return _ring(rest[at], hinges[at], weight[at], moved[at], inertia[at], standing)

    rung = parallel_map(ring, _parts(len(rest)))
    phi, squares, modes = (np.concatenate(each) for each in zip(*rung, strict=True))
    turning = step * np.stack([-np.sin(phi), -np.cos(phi)], axis=1)
    points, centre = _curve(phi, step, masses @ shares, masses)
    root = np.column_stack(np.broadcast_arrays(_column(values, "beam_root"), [[0.0]]))
    return SmallMotions(
        tip=root + points[:, :, -1],
        centre=root + centre,
        omega=np.sqrt(squares),
        swing=turning @ modes,
    )


def stand(values: Values, angles: ArrayLike, length: float, *, standing: bool = False) -> Stand:
    """Return where shapes are when their robots stand, the rotor a point at T.

    The foot pitches on the springs of its four corners, a hinge in series with the beam's root.

    Args:
        values: of the model.
        angles: (n, N) [rad].
        length: of the beam [m].
        standing: whether the angles are those under gravity, else those of the free strip.
    """
    rest, step, shares, masses, weight, hinges = _chain(values, angles, length)
    spring, root = _column(values, "ground_stiffness"), _column(values, "beam_root")
    rocking = spring * _column(values, "foot_length") ** 2  # [N m/rad]
    gravity = _column(values, "gravity")
    load = gravity * masses.sum(axis=1, keepdims=True)  # [N]
    carried = masses @ shares
    if standing:
        x, z = _curve(rest, step, carried, masses)[1].T[:, :, None]
        phi = rest + load * (root + x) / (rocking - load * z)
    else:
        rest = rest + load * root / rocking
        hinges[:, :1] = 1 / (1 / hinges[:, :1] + 1 / rocking)

        def balanced(at: slice) -> Array:
            return _balanced(rest[at], hinges[at], weight[at])

        phi = np.concatenate(parallel_map(balanced, _parts(len(rest))))
    points, centre = _curve(phi, step, carried, masses)
    pitch = load * (root + centre[:, :1]) / rocking
    above_foot = points[:, 1] - root * pitch
    sunk = (load + gravity * _column(values, "foot_mass")) / (4 * spring)
    return Stand(
        tip_x=root[:, 0] + points[:, 0, -1],
        tip_z=above_foot[:, -1] - sunk[:, 0],
        lowest=above_foot.min(axis=1),
    )


def descriptors(motions: SmallMotions) -> Array:
    """Return what distinguishes shapes, (n, 13) [unit of each], its columns as in `DESCRIPTORS`.

    Of the two slowest modes the one that swings T more up as it goes forward is called rising, the
    other falling. Either can be the slower one, and what drives the hop is the rising one: the best
    high beams have it second, the best low beams first. A mode swings T along a line, not along an
    arrow, so its direction counts twice its angle; its reach is the logarithm of how far T swings.
    """
    x, z = motions.swing[:, 0, :2], motions.swing[:, 1, :2]
    turned = 2 * np.arctan2(z, x)
    modes = np.stack([
        motions.omega[:, :2], np.cos(turned), np.sin(turned),
        np.log(np.maximum(np.hypot(x, z), _SHORTEST)),
    ])  # fmt: skip
    swapped = modes[2, :, 0] < modes[2, :, 1]
    modes[:, swapped] = modes[:, swapped, ::-1]
    omega, across, along, reach = modes
    directions = np.stack([across, along], axis=2).reshape(len(x), 4)
    return np.column_stack(
        [motions.tip, motions.centre, omega, motions.omega[:, 2], directions, reach]
    )


def _parts(count: int) -> list[slice]:
    return [slice(k, k + _AT_ONCE) for k in range(0, max(count, 1), _AT_ONCE)]


def _chain(
    values: Values, angles: ArrayLike, length: float
) -> tuple[Array, float, Array, Array, Array, Array]:
    """Return absolute angles of the free strip, an increment's length, bodies, weight, hinges."""
    rest = np.cumsum(np.atleast_2d(np.asarray(angles, dtype=np.float64)), axis=1)
    step = length / rest.shape[1]
    shares, masses = _bodies(values, *rest.shape)
    weight = np.ascontiguousarray(step * _column(values, "gravity") * (masses @ shares))
    return rest, step, shares, masses, weight, _hinges(values, rest.shape)


def _curve(phi: Array, step: float, carried: Array, masses: Array) -> tuple[Array, Array]:
    """Return the ends of the increments from the root, (n, 2, N), and the centre, (n, 2) [m]."""
    along = step * np.stack([np.cos(phi), -np.sin(phi)], axis=1)
    centre = (along * carried[:, None]).sum(axis=2) / masses.sum(axis=1)[:, None]
    return np.cumsum(along, axis=2), centre


def _column(values: Values, name: str) -> Array:
    return np.asarray(values[name], dtype=np.float64).reshape(-1, 1)


def _bodies(values: Values, shapes: int, count: int) -> tuple[Array, Array]:
    """Return how far each body's centre moves with each increment, (b, N), and masses, (n, b)."""
    shares = np.tril(np.ones((count + 1, count)), -1)
    shares[:count] += 0.5 * np.eye(count)
    top = sum(_column(values, name) for name in ("top_mass", "rotor_mass", "rotor_arm_mass"))
    increment = np.broadcast_to(_column(values, "beam_mass") / count, (shapes, count))
    return shares, np.column_stack([increment, np.broadcast_to(top, (shapes, 1))])


def _hinges(values: Values, size: tuple[int, ...]) -> Array:
    """Return the stiffness of each hinge, (n, N) [N m/rad]."""
    hinges = np.broadcast_to(_column(values, "hinge_stiffness"), size).copy()
    hinges[:, :1] = _column(values, "root_stiffness")
    return hinges


@numba.njit(nogil=True, cache=True)
def _ring(
    rest: Array, hinges: Array, weight: Array, moved: Array, inertia: Array, standing: bool
) -> tuple[Array, Array, Array]:
    """Return absolute angles under gravity, squares of the slowest frequencies, and their modes.

    The stiffness in absolute angles has three diagonals, K = L D L'; the slowest modes are the
    greatest eigenvalues of C = (L sqrt D)^-1 M (L sqrt D)^-T, by subspace iteration (Parlett, "The
    symmetric eigenvalue problem", 1998, chapter 14).

    Args:
        rest: (n, N) absolute angles of the strip without forces [rad].
        hinges: (n, N) stiffness [N m/rad].
        weight: (n, N) gravity on what each increment carries, times its length [N m].
        moved: (n, N, N) inertia of parallel increments [kg m^2].
        inertia: (n, N) of each about its centre.
        standing: whether the angles are those under gravity.

    Returns:
        (n, N) [rad]; (n, 3), rising [1/s^2], zero where it would buckle; (n, N, 3) of unit modal
        mass.
    """
    count, size = rest.shape
    phi, squares, modes = rest.copy(), np.zeros((count, _MODES)), np.zeros((count, size, _MODES))
    pivot, below = np.empty(size), np.zeros(size)
    inner, space, image = np.empty((size, size)), np.empty((size, _SUBSPACE)), np.empty(size)
    for n in range(count):
        k = hinges[n]
        if not standing:
            _balance(rest[n], k, weight[n], phi[n])
        if not _factor(k, weight[n], phi[n], pivot, below):
            continue
        root = np.sqrt(pivot)
        for i in range(size):
            for j in range(size):
                inner[i, j] = moved[n, i, j] * math.cos(phi[n, i] - phi[n, j])
            inner[i, i] += inertia[n, i]
        for turn in range(2):  # rows, then columns of the symmetric matrix
            for i in range(size):
                row = inner[i] if turn == 0 else inner[:, i]
                _forward(below, row)
                for j in range(size):
                    row[j] /= root[j]
        for j in range(size):
            for c in range(_SUBSPACE):
                space[j, c] = math.cos(math.pi * c * (j + 0.5) / size)
        for _ in range(_ITERATIONS):
            for c in range(_SUBSPACE):
                for i in range(size):
                    image[i] = 0.0
                    for j in range(size):
                        image[i] += inner[i, j] * space[j, c]
                for before in range(c):
                    along = 0.0
                    for i in range(size):
                        along += space[i, before] * image[i]
                    for i in range(size):
                        image[i] -= along * space[i, before]
                length = math.sqrt((image * image).sum())
                for i in range(size):
                    space[i, c] = image[i] / length
        values, mixed = np.linalg.eigh(space.T @ (inner @ space))
        for mode in range(_MODES):
            c = _SUBSPACE - 1 - mode
            squares[n, mode] = 1.0 / values[c]
            for i in range(size):
                image[i] = 0.0
                for s in range(_SUBSPACE):
                    image[i] += space[i, s] * mixed[s, c]
                image[i] /= root[i]
            _backward(below, image)
            for i in range(size):
                modes[n, i, mode] = image[i] / math.sqrt(values[c])
    return phi, squares, modes


@numba.njit(nogil=True, cache=True)
def _balanced(rest: Array, hinges: Array, weight: Array) -> Array:
    """Return absolute angles under gravity, (n, N) [rad]; NaN where the strip would buckle."""
    phi, size = rest.copy(), rest.shape[1]
    pivot, below = np.empty(size), np.zeros(size)
    for n in range(len(rest)):
        _balance(rest[n], hinges[n], weight[n], phi[n])
        if not _factor(hinges[n], weight[n], phi[n], pivot, below):
            phi[n] = np.nan
    return phi


@numba.njit(cache=True)
def _balance(rest: Array, k: Array, weight: Array, phi: Array) -> None:
    """Turn the increments of a shape to where gravity and hinges balance, by Newton's method."""
    size = len(rest)
    pivot, below, step = np.empty(size), np.zeros(size), np.empty(size)
    for _ in range(_ROUNDS):
        for j in range(size):
            bend = (rest[j] - phi[j]) * k[j]
            if j > 0:
                bend -= (rest[j - 1] - phi[j - 1]) * k[j]
            step[j] = bend + weight[j] * math.cos(phi[j])
            if j + 1 < size:
                off = rest[j + 1] - phi[j + 1] - rest[j] + phi[j]
                step[j] -= off * k[j + 1]
        _factor(k, weight, phi, pivot, below)
        _forward(below, step)
        for j in range(size):
            step[j] /= pivot[j]
        _backward(below, step)
        longest = max(np.abs(step).max(), _LONGEST_STEP_RAD)
        for j in range(size):
            phi[j] += step[j] * _LONGEST_STEP_RAD / longest
        if np.abs(step).max() < _BALANCED_RAD:
            break


@numba.njit(cache=True)
def _factor(k: Array, weight: Array, phi: Array, pivot: Array, below: Array) -> bool:
    """Write D and the subdiagonal of L of a stiffness; return whether it is positive definite."""
    sound, size = True, len(k)
    for j in range(size):
        pivot[j] = k[j] + (k[j + 1] if j + 1 < size else 0.0) + weight[j] * math.sin(phi[j])
        if j > 0:
            below[j] = -k[j] / pivot[j - 1]
            pivot[j] -= below[j] * below[j] * pivot[j - 1]
        sound = sound and pivot[j] > 0.0
    return sound


@numba.njit(cache=True)
def _forward(below: Array, values: Array) -> None:
    for j in range(1, len(values)):
        values[j] -= below[j] * values[j - 1]


@numba.njit(cache=True)
def _backward(below: Array, values: Array) -> None:
    for j in range(len(values) - 1, 0, -1):
        values[j - 1] -= below[j] * values[j]
