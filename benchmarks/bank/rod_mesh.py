"""The strip as a planar inextensible curve: quadrature points and the shapes that it bends in.

Tangent angle theta(s) about +y, tangent (cos theta, -sin theta). As in the thesis the half
increments at both ends are straight; the curvature at rest is the slope of a cubic spline through
the listed angles summed up, so that every increment bends by its listed angle, smoothly.

What the strip adds to its bend is a sum of the slowest clamped modes of the strip at rest, found
from a foot joint and `_POLYNOMIALS` Legendre polynomials of curvature. A foot joint with play turns
by itself within it, which slow modes do not do, so there it is one more shape. The kinematics stay
exact: only the angle theta(s) is expanded, never the place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legint, legval
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

__all__ = ["MODES", "POINTS", "Mesh", "make_mesh"]

Array = NDArray[np.float64]

MODES = 7
"""Three more move T by less than 0.02 mm in 8 s of driven motion; `test_rod` holds that."""
POINTS = 3
_POLYNOMIALS = 14
_BORDER = 0.02  # of the strip, over which a loss of stiffness sets in
_NODES, _WEIGHTS = leggauss(POINTS)


class Mesh(NamedTuple):
    """Tables along the strip; p points, e elements of three points each, n shapes.

    Args:
        angle: (p + 1,) theta at rest, from the foot [rad]; the last row is T.
        turn: (p + 1, n) turn of the tangent by each shape.
        bend: (p, n) bend of a listed increment by each shape, zero in the straight ends.
        bend_scale: (p,) hinges that a point stands for.
        stiffness: (p,) factor on the hinge's stiffness.
        mass: (p,) [kg].
        root: (n,) turn of the foot joint.
        lengths: (e,) of the elements [m].
        part: (3, 3) integrates from an element's start to its points, in units of its length.
        whole: (3,) integrates over an element.
        uniform: (n, n) hinge bends squared: the strip's energy for a hinge stiffness of one.
    """

    angle: Array
    turn: Array
    bend: Array
    bend_scale: Array
    stiffness: Array
    mass: Array
    root: Array
    lengths: Array
    part: Array
    whole: Array
    uniform: Array


def make_mesh(
    angles: Sequence[float],
    length: float,
    values: Mapping[str, float],
    modes: int = MODES,
    profile: Mapping[str, float] | None = None,
    joint: bool = False,
) -> Mesh:
    """Return the strip's tables.

    Args:
        angles: the listed ones, the first at the foot [rad].
        length: of the strip [m].
        values: masses and stiffness by their names in the model, SI.
        modes: how many shapes.
        profile: `near_foot`, `middle`, `near_top`, the share of stiffness lost in a third, with
            soft borders, and `bend` [rad] that the strip took as a set, spread evenly.
        joint: whether the foot joint turns by itself as well, as one with play does.
    """
    profile = profile or {}
    increment = length / len(angles)
    lengths = np.concatenate([[0.5], np.ones(len(angles) - 1), [0.5]]) * increment
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    places = (starts[:, None] + lengths[:, None] * (1 + _NODES) / 2).ravel()
    weights = (lengths[:, None] * _WEIGHTS / 2).ravel()
    flexible = np.repeat((lengths > 0.75 * increment), POINTS)
    inside = (places - increment / 2) / (length - increment)
    rest = _rest_angle(angles, increment, np.append(places, length))
    rest += profile.get("bend", 0.0) * np.clip(np.append(inside, 1.0), 0.0, 1.0)
    turn, bend, root = _polynomials(np.append(inside, 1.0), flexible, increment / length)
    stiffness = np.ones(len(places))
    for third, name in enumerate(("near_foot", "middle", "near_top")):
        window = np.tanh((inside - third / 3) / _BORDER) - np.tanh(
            (inside - (third + 1) / 3) / _BORDER
        )
        stiffness -= profile.get(name, 0.0) * window / 2
    mesh = Mesh(
        rest, turn, bend, np.where(flexible, weights / increment, 0.0), stiffness,
        values["beam_mass"] * weights / length, root, lengths, _within(), _WEIGHTS / 2,
        np.zeros((0, 0)),
    )  # fmt: skip
    return _in_modes(mesh, values, modes, joint)


def _rest_angle(angles: Sequence[float], increment: float, places: Array) -> Array:
    ends = (np.arange(len(angles)) + 0.5) * increment
    turned = np.concatenate([[0.0], np.cumsum(angles[1:])])
    within = np.clip(places, ends[0], ends[-1])
    return CubicSpline(ends, turned, bc_type="natural")(within)


def _polynomials(
    inside: Array, flexible: NDArray[np.bool_], cell: float
) -> tuple[Array, Array, Array]:
    """Return turn, bend and root of a foot joint and polynomials of curvature."""
    x = 2 * np.clip(inside, 0.0, 1.0) - 1
    turn, bend = [np.ones_like(x)], [np.zeros(len(x) - 1)]
    for degree in range(_POLYNOMIALS):
        unit = np.eye(_POLYNOMIALS)[degree]
        turn.append(legval(x, legint(unit, lbnd=-1)) / 2)
        share = cell / (1 - cell)  # of the flexible part, that one increment is
        bend.append(np.where(flexible, share * legval(x[:-1], unit), 0.0))
    root = np.zeros(_POLYNOMIALS + 1)
    root[0] = 1.0
    return np.column_stack(turn), np.column_stack(bend), root


def _within() -> Array:
    """Return the integrals of the points' Lagrange polynomials up to each point."""
    part = np.zeros((POINTS, POINTS))
    for k in range(POINTS):
        values = np.eye(POINTS)[k]
        antiderivative = np.polyint(np.polyfit(_NODES, values, POINTS - 1))
        part[:, k] = np.polyval(antiderivative, _NODES) - np.polyval(antiderivative, -1.0)
    return part / 2


def _in_modes(mesh: Mesh, values: Mapping[str, float], count: int, joint: bool) -> Mesh:
    """Return the mesh in its slowest modes, rotor and top as masses at T."""
    normal = -np.column_stack([np.sin(mesh.angle), np.cos(mesh.angle)])[:-1]
    share = normal[:, None, :] * mesh.turn[:-1, :, None]
    per_element = share.reshape(len(mesh.lengths), POINTS, *share.shape[1:])
    sums = np.einsum("k,eknc,e->enc", mesh.whole, per_element, mesh.lengths)
    starts = np.cumsum(sums, axis=0) - sums
    parts = np.einsum("jk,eknc,e->ejnc", mesh.part, per_element, mesh.lengths)
    moved = (starts[:, None] + parts).reshape(share.shape)
    top = sums.sum(axis=0)
    heavy = values["top_mass"] + values["rotor_mass"] + values["rotor_arm_mass"]
    mass = np.einsum("p,pnc,pmc->nm", mesh.mass, moved, moved) + heavy * top @ top.T
    turning = values["rotor_mass"] * values["rotor_radius"] ** 2
    mass += turning * np.outer(mesh.turn[-1], mesh.turn[-1])
    bends = np.einsum("p,pn,pm->nm", mesh.bend_scale, mesh.bend, mesh.bend)
    stiffness = values["hinge_stiffness"] * bends
    stiffness += values["root_stiffness"] * np.outer(mesh.root, mesh.root)
    shapes = np.asarray(eigh(stiffness, mass)[1])[:, :count]
    if joint:
        shapes = np.column_stack([shapes, mesh.root])  # the first shape so far is that joint
    shapes = shapes / np.abs(mesh.turn @ shapes).max(axis=0)
    return mesh._replace(
        turn=np.ascontiguousarray(mesh.turn @ shapes),
        bend=np.ascontiguousarray(mesh.bend @ shapes),
        root=np.ascontiguousarray(mesh.root @ shapes),
        uniform=np.ascontiguousarray(shapes.T @ bends @ shapes),
    )
