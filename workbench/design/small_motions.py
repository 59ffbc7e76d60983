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

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["DESCRIPTORS", "SmallMotions", "descriptors", "small_motions"]

Values = Mapping[str, ArrayLike]
"""Model values, SI, each a number or one for each shape, (n,)."""

_ROUNDS = 12
_LONGEST_STEP_RAD = 0.3  # of a round; a soft strip folds far
_MODES = 3
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
        swing: (x, z) of T in each mode of unit modal mass, (n, 2, 3) [1/sqrt(kg)].
        lowest: height of the strip's lowest point above its root, (n,) [m].
    """

    tip: NDArray[np.float64]
    centre: NDArray[np.float64]
    omega: NDArray[np.float64]
    swing: NDArray[np.float64]
    lowest: NDArray[np.float64]


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
    rest = np.cumsum(np.atleast_2d(np.asarray(angles, dtype=np.float64)), axis=1)
    count = rest.shape[1]
    step = length / count
    shares, masses = _bodies(values, rest.shape[0], count)
    carried = masses @ shares
    bending = _chain(values, "stiffness", rest.shape)
    weight = step * _column(values, "gravity") * carried
    phi = rest if standing else _settled(rest, bending, weight)
    stiffness = bending + _diagonal(weight * np.sin(phi))
    inertia = _inertia(values, phi, shares, masses, step)
    squares, modes = _modes(stiffness, inertia)
    turning = step * np.stack([-np.sin(phi), -np.cos(phi)], axis=1)
    along = step * np.stack([np.cos(phi), -np.sin(phi)], axis=1)
    root = np.column_stack(
        [np.broadcast_to(_column(values, "beam_root"), (len(rest), 1)), np.zeros(len(rest))]
    )
    return SmallMotions(
        tip=root + along.sum(axis=2),
        centre=root + (along * carried[:, None]).sum(axis=2) / masses.sum(axis=1)[:, None],
        omega=np.sqrt(np.maximum(squares[:, :_MODES], 0.0)),
        swing=turning @ modes[:, :, :_MODES],
        lowest=np.cumsum(along[:, 1], axis=1).min(axis=1),
    )


def descriptors(motions: SmallMotions) -> NDArray[np.float64]:
    """Return what tells shapes apart, (n, 13), its columns as in `DESCRIPTORS`.

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
    directions = np.stack([across, along], axis=2).reshape(len(x), -1)
    return np.column_stack(
        [motions.tip, motions.centre, omega, motions.omega[:, 2], directions, reach]
    )


def _column(values: Values, name: str) -> NDArray[np.float64]:
    return np.asarray(values[name], dtype=np.float64).reshape(-1, 1)


def _bodies(
    values: Values, shapes: int, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far each body's centre moves with each increment, (b, N), and masses, (n, b)."""
    shares = np.tril(np.ones((count + 1, count)), -1)
    shares[:count] += 0.5 * np.eye(count)
    top = sum(_column(values, name) for name in ("top_mass", "rotor_mass", "rotor_arm_mass"))
    increment = np.broadcast_to(_column(values, "beam_mass") / count, (shapes, count))
    return shares, np.column_stack([increment, np.broadcast_to(top, (shapes, 1))])


def _chain(values: Values, what: str, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the matrix of hinges in absolute angles, (n, N, N): each acts on a difference."""
    hinges = np.broadcast_to(_column(values, f"hinge_{what}"), size).copy()
    hinges[:, :1] = _column(values, f"root_{what}")
    differences = np.eye(size[1]) - np.eye(size[1], k=-1)
    return np.einsum("ji,nj,jk->nik", differences, hinges, differences)


def _settled(
    rest: NDArray[np.float64], bending: NDArray[np.float64], weight: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the absolute angles under gravity, (n, N), by Newton's method with bounded steps."""
    phi = rest
    for _ in range(_ROUNDS):
        force = np.einsum("njk,nk->nj", bending, rest - phi) + weight * np.cos(phi)
        stiffness = bending + _diagonal(weight * np.sin(phi))
        step = np.linalg.solve(stiffness, force[..., None])[..., 0]
        longest = np.maximum(np.abs(step).max(axis=1, keepdims=True), _LONGEST_STEP_RAD)
        phi = phi + step * (_LONGEST_STEP_RAD / longest)
    return phi


def _inertia(
    values: Values,
    phi: NDArray[np.float64],
    shares: NDArray[np.float64],
    masses: NDArray[np.float64],
    step: float,
) -> NDArray[np.float64]:
    moved = np.einsum("bj,nb,bk->njk", shares, masses, shares) * step**2
    own = np.broadcast_to(masses[:, :1] * step**2 / 12, phi.shape).copy()
    own[:, -1:] += _column(values, "top_mass") * step**2 / 12
    return moved * np.cos(phi[:, :, None] - phi[:, None, :]) + _diagonal(own)


def _modes(
    stiffness: NDArray[np.float64], inertia: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return squares of the natural frequencies, rising, and modes of unit modal mass."""
    inverse = np.linalg.inv(np.linalg.cholesky(inertia))
    squares, modes = np.linalg.eigh(inverse @ stiffness @ np.swapaxes(inverse, 1, 2))
    shapes = np.asarray(np.swapaxes(inverse, 1, 2) @ modes, dtype=np.float64)
    return np.asarray(squares, dtype=np.float64), shapes


def _diagonal(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[..., None] * np.eye(values.shape[-1])
