"""The names of foot, T and rotor in an export, and a guess by geometry where they are unknown."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.tracking.axes import Axes
from workbench.tracking.labels import MAKE_BODIES
from workbench.tracking.take import Take, known

__all__ = ["FOOT_TOP_M", "TOP_ROTOR_M", "BodyNames", "check_names", "guess_bodies"]

Array = NDArray[np.float64]

FOOT_TOP_M = (0.16, 0.6)
"""Least and greatest distance of T from the foot, Appendix C of the thesis."""
TOP_ROTOR_M = (0.01, 0.2)
"""Least and greatest distance of the rotor from T, Appendix C."""

_NEARLY_ALWAYS = 0.95  # share of samples; the rest are glitches
_LEAST_SAMPLES = 20
_MOST_SAMPLES = 2000
_ARM_SPREAD = 0.1  # of the radius at which the rotor circles T
_TURNED = 1.8  # chord over radius: 128 degrees
_APART = 1.5  # factor between the best explanation and the next


@dataclass(frozen=True)
class BodyNames:
    """Names of the robot's three bodies in the export."""

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
    if not take.bodies:
        raise InputError(f"{take.path}: the take has no bodies, only markers; {MAKE_BODIES}")
    roles = {"foot": names.foot, "top": names.top, "rotor": names.rotor}
    for role, name in roles.items():
        if name not in take.bodies:
            unknown = f"{take.path}: the {role} {_unknown(name, list(take.bodies))}"
            raise InputError(f"{unknown}{_by_distances(take, axes, unknown)}")
    if len(set(roles.values())) < len(roles):
        raise InputError(f"foot, top and rotor need three bodies; named are {roles}")
    for name in placed:
        if name not in take.bodies:
            raise InputError(f"{take.path}: markers: body {_unknown(name, list(take.bodies))}")


def guess_bodies(take: Take, axes: Axes | None = None) -> BodyNames | None:
    """Guess which bodies of a take are foot, T and rotor, from how far apart they are.

    Foot to T is 0.16 to 0.6 m and T to rotor 0.01 to 0.2 m in nearly all samples (Appendix C); the
    rotor keeps its distance from T. Of such a pair the rotor is the one that rotates by its poses,
    or without them, the one that moves more while the rotor makes its first half turn.
    The foot is the body whose distance from T changes least.

    Args:
        take: the export, with any number of bodies.
        axes: how its axes lie; if given, T must be above the foot.

    Returns:
        The names; None where no three bodies fit, or where others fit nearly as well.
    """
    names = list(take.bodies)
    if len(names) < 3:
        return None
    paths = [take.body_path(name) for name in names]
    thin = np.stack([path[:: max(1, len(take) // _MOST_SAMPLES)] for path in paths])
    distance = np.linalg.norm(thin[:, None] - thin[None], axis=3)  # (b, b, k)
    near, far = (_always_within(distance, allowed) for allowed in (TOP_ROTOR_M, FOOT_TOP_M))
    found: list[tuple[float, BodyNames]] = []
    for foot, top, rotor in permutations(range(len(names)), 3):
        fits = near[top, rotor] and far[foot, top] and _circles(distance[top, rotor])
        if fits and _above(thin[foot], thin[top], axes):
            guess = BodyNames(names[foot], names[top], names[rotor])
            if _rotor_turns(take, guess, paths[foot], paths[top], paths[rotor]):
                found.append((_spread(distance[foot, top]), guess))
    found.sort(key=lambda each: each[0])
    if not found or (len(found) > 1 and found[1][0] < _APART * found[0][0]):
        return None
    return found[0][1]


def _unknown(name: str, names: list[str]) -> str:
    hint = did_you_mean(name, names, likeness=0.4)
    return f"{name!r} is not in the take; there are {', '.join(map(repr, names))}{hint}"


def _by_distances(take: Take, axes: Axes, before: str) -> str:
    guess = guess_bodies(take, axes)
    if guess is None:
        return ""
    roles = asdict(guess)
    guessed = ", ".join(f"{role} is {name!r}" for role, name in roles.items())
    written = ", ".join(f"{role}: {_in_yaml(name)}" for role, name in roles.items())
    stop = "" if before.endswith("?") else "."
    return f"{stop} By their distances {guessed}: write bodies: {{{written}}}"


def _in_yaml(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z][\w -]*\w|[A-Za-z]", name) else json.dumps(name)


def _always_within(distance: Array, allowed: tuple[float, float]) -> NDArray[np.bool_]:
    """Find pairs (b, b) whose distance is within bounds in nearly all samples that show both."""
    both = np.isfinite(distance).sum(axis=2)
    inside = ((distance >= allowed[0]) & (distance <= allowed[1])).sum(axis=2)
    return (both >= _LEAST_SAMPLES) & (inside >= _NEARLY_ALWAYS * both)


def _circles(arm: Array) -> bool:
    return _spread(arm) <= _ARM_SPREAD * float(np.median(_finite(arm)))


def _spread(values: Array) -> float:
    """Return the distance of the 5 and 95 % quantiles of the finite values."""
    low, high = np.quantile(_finite(values), [0.05, 0.95])
    return float(high - low)


def _rotor_turns(take: Take, guess: BodyNames, foot: Array, top: Array, rotor: Array) -> bool:
    """Return whether of T and rotor, as guessed, it is the rotor that turns."""
    top_turns, rotor_turns = (_turns(take, name) for name in (guess.top, guess.rotor))
    if top_turns != rotor_turns:
        return rotor_turns
    arm, seen = rotor - top, np.flatnonzero(known(foot + top + rotor))
    if len(seen) < _LEAST_SAMPLES:
        return False
    start = np.median(arm[seen[:_LEAST_SAMPLES]], axis=0)
    turned = np.linalg.norm(arm[seen] - start, axis=1) > _TURNED * np.linalg.norm(start)
    if not turned.any():
        return False
    first = seen[: int(np.argmax(turned)) + 1]
    moved = [np.linalg.norm(np.ptp((path - foot)[first], axis=0)) for path in (top, rotor)]
    return bool(moved[1] > _APART * moved[0])


def _turns(take: Take, name: str) -> bool:
    """Return whether over 5 % of a body's poses are turned by more than a quarter turn."""
    body = take.bodies[name]
    quaternion = body.quaternion[body.seen & known(body.quaternion)]
    if len(quaternion) < _LEAST_SAMPLES:
        return False
    cosine = np.abs(quaternion @ quaternion[0])  # of half the angle
    return bool(np.mean(cosine < np.cos(np.pi / 4)) > 1 - _NEARLY_ALWAYS)


def _above(foot: Array, top: Array, axes: Axes | None) -> bool:
    if axes is None:
        return True
    height = axes.points_to_bench(top - foot)[:, 2]
    return float(np.median(_finite(height))) > 0


def _finite(values: Array) -> Array:
    return values[np.isfinite(values)]
