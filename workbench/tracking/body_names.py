"""What an export calls foot, T and rotor, and a guess by geometry where the names are not known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.tracking.axes import Axes
from workbench.tracking.take import Take, known

__all__ = ["BodyNames", "check_names", "guess_bodies"]

_FOOT_TOP_M = (0.16, 0.6)  # Appendix C
_TOP_ROTOR_M = (0.01, 0.2)  # Appendix C
_NEARLY_ALWAYS = 0.95  # share of samples; the rest are glitches
_LEAST_SAMPLES = 20
_MOST_SAMPLES = 2000
_ARM_SPREAD = 0.1  # of the radius at which the rotor circles T
_APART = 1.5  # one explanation is told from the next by this factor


@dataclass(frozen=True)
class BodyNames:
    """What the export calls the robot's three bodies."""

    foot: str = "Foot"
    top: str = "T"
    rotor: str = "Rotor"


def check_names(take: Take, names: BodyNames, placed: Iterable[str], axes: Axes) -> None:
    """Refuse names that are not in the take.

    Args:
        take: the export.
        names: of the robot's bodies.
        placed: names of bodies whose marker places are given.
        axes: how the export's axes lie.

    Raises:
        InputError: with the names that exist, and the bodies that move like a robot.
    """
    roles = {"foot": names.foot, "top": names.top, "rotor": names.rotor}
    for role, name in roles.items():
        if name not in take.bodies:
            unknown = _unknown(name, list(take.bodies))
            raise InputError(f"{take.path}: the {role} {unknown}{_by_distances(take, axes)}")
    if len(set(roles.values())) < len(roles):
        raise InputError(f"foot, top and rotor need three bodies; named are {roles}")
    for name in placed:
        if name not in take.bodies:
            raise InputError(f"{take.path}: markers: body {_unknown(name, list(take.bodies))}")


def guess_bodies(take: Take, axes: Axes | None = None) -> BodyNames | None:
    """Guess which bodies of a take are foot, T and rotor, from how far apart they are.

    Foot to T is 0.16 to 0.6 m and T to rotor 0.01 to 0.2 m in nearly all samples (Appendix C); the
    rotor keeps its distance from T. Either of a pair that circles the other fits that, so T is the
    one whose distance from the foot changes less.

    Args:
        take: the export, with any number of bodies.
        axes: how its axes lie; if given, T must be above the foot.

    Returns:
        The names; None where no three bodies fit, or where others fit nearly as well.
    """
    names = list(take.bodies)
    paths = np.stack([_path(take, name) for name in names]) if names else np.empty((0, 0, 3))
    distance = np.linalg.norm(paths[:, None] - paths[None], axis=3)  # (b, b, k)
    near = _always_within(distance, _TOP_ROTOR_M)
    far = _always_within(distance, _FOOT_TOP_M)
    spread = _spread(distance)
    found: list[tuple[float, tuple[int, int, int]]] = []
    for foot, top, rotor in permutations(range(len(names)), 3):
        arm = float(np.median(_finite(distance[top, rotor]))) if near[top, rotor] else 0.0
        circles = near[top, rotor] and spread[top, rotor] <= _ARM_SPREAD * arm
        if far[foot, top] and circles and _above(paths[foot], paths[top], axes):
            found.append((float(spread[foot, top]), (foot, top, rotor)))
    found.sort()
    if not found or (len(found) > 1 and found[1][0] < _APART * found[0][0]):
        return None
    return BodyNames(*(names[i] for i in found[0][1]))


def _unknown(name: str, names: list[str]) -> str:
    hint = did_you_mean(name, names, likeness=0.4)
    return f"{name!r} is not in the take; there are {', '.join(map(repr, names))}{hint}"


def _by_distances(take: Take, axes: Axes) -> str:
    guess = guess_bodies(take, axes)
    if guess is None:
        return ""
    foot, top, rotor = astuple(guess)
    return (
        f". By their distances foot is {foot!r}, top {top!r}, rotor {rotor!r}: "
        f"write bodies: {{foot: {foot}, top: {top}, rotor: {rotor}}}"
    )


def _path(take: Take, name: str) -> NDArray[np.float64]:
    """Return up to 2000 evenly spread positions (k, 3) of a body [m], NaN where it is not seen."""
    every = max(1, len(take) // _MOST_SAMPLES)
    body = take.bodies[name]
    path = body.centroid_measured[::every]
    if not known(path).any():
        path = take.counted_position(name)[::every]
    return np.where(body.seen[::every, None], path, np.nan)


def _always_within(
    distance: NDArray[np.float64], allowed: tuple[float, float]
) -> NDArray[np.bool_]:
    """Tell pairs (b, b) whose distance is within bounds in nearly all samples that show both."""
    both = np.isfinite(distance).sum(axis=2)
    inside = ((distance >= allowed[0]) & (distance <= allowed[1])).sum(axis=2)
    return (both >= _LEAST_SAMPLES) & (inside >= _NEARLY_ALWAYS * both)


def _spread(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much the distances of pairs (b, b) change: 5 to 95 % quantile [m], inf if none."""
    spread = np.full(distance.shape[:2], np.inf)
    for pair in np.ndindex(spread.shape):
        values = _finite(distance[pair])
        if len(values):
            low, high = np.quantile(values, [0.05, 0.95])
            spread[pair] = high - low
    return spread


def _above(foot: NDArray[np.float64], top: NDArray[np.float64], axes: Axes | None) -> bool:
    if axes is None:
        return True
    height = axes.points_to_bench(top - foot)[:, 2]
    return float(np.median(_finite(height))) > 0


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[np.isfinite(values)]
