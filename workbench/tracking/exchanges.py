"""Undo exchanges of bodies by the tracker, in takes without measured markers.

A tracker fits its rigid bodies anew in every frame, and may exchange two of them for a while. Where
the file has measured markers, they identify the bodies (`identity`). Where it has only poses or
solved markers, the paths of the bodies do: at both ends of an exchange they jump onto one another.
The distance of the two stays right meanwhile, so no rule of distances finds it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.tracking.body_names import BodyNames
from workbench.tracking.identity import exchange_summary, untangle
from workbench.tracking.take import BodyTake, SampleStatus, Take, any_finite, known

__all__ = ["Exchange", "exchanged_back", "without_exchanges"]


@dataclass(frozen=True)
class Exchange:
    """Two bodies that the file has the wrong way round.

    Args:
        bodies: their names.
        first: frame index from which on they are exchanged; None from the first frame on.
        last: the last such frame index; None to the last frame.
    """

    bodies: tuple[str, str]
    first: int | None = None
    last: int | None = None


def exchanged_back(take: Take, exchanges: Sequence[Exchange]) -> Take:
    """Return a take without the exchanges that a sheet states; a warning repeats each.

    Raises:
        InputError: a body is not in the take, or no frame lies in the range.
    """
    bodies, warnings = dict(take.bodies), list(take.warnings)
    for stated in exchanges:
        for name in stated.bodies:
            if name not in bodies:
                raise InputError(
                    f"{take.path}: exchanged: {name!r} is not in the take; there are "
                    f"{', '.join(map(repr, bodies))}{did_you_mean(name, bodies)}"
                )
        first, last = (
            take.indices[end] if given is None else given
            for end, given in ((0, stated.first), (-1, stated.last))
        )
        rows = (take.indices >= first) & (take.indices <= last)
        if not rows.any():
            raise InputError(
                f"{take.path}: exchanged: no frame lies from {first} to {last}; the take has "
                f"{take.indices[0]} to {take.indices[-1]}"
            )
        a, b = stated.bodies
        bodies[a], bodies[b] = _swapped(bodies[a], bodies[b], rows)
        warnings.append(
            f"{a!r} and {b!r} were exchanged in {np.count_nonzero(rows)} samples, as stated"
        )
    return replace(take, bodies=bodies, warnings=tuple(warnings))


def without_exchanges(take: Take, names: BodyNames) -> tuple[Take, list[str]]:
    """Undo exchanges of the robot's bodies that their paths show.

    Args:
        take: the export; bodies with measured markers are left as they are.
        names: of the robot's bodies.

    Returns:
        The take, itself where there was nothing to undo, and a sentence on each pair of bodies.
    """
    bodies, warnings = dict(take.bodies), []
    for one, other in (
        (names.top, names.rotor),
        (names.foot, names.top),
        (names.foot, names.rotor),
    ):
        a, b = bodies[one], bodies[other]
        if any_finite(a.measured) or any_finite(b.measured):
            continue
        paths = np.stack([_path(a), _path(b)], axis=1)
        exchanged = untangle(take.times, paths, partly=False).exchanged
        sentence = exchange_summary(take.times, exchanged, f"{one!r} and {other!r}", "bodies")
        if sentence is None:
            continue
        exchanged, unsure = _around(exchanged, np.asarray(known(paths).all(axis=1)))
        a, b = _swapped(a, b, exchanged)
        bodies[one] = a.without(unsure, SampleStatus.GLITCH)
        bodies[other] = b.without(unsure, SampleStatus.GLITCH)
        warnings.append(sentence)
    return (replace(take, bodies=bodies) if warnings else take), warnings


def _path(body: BodyTake) -> NDArray[np.float64]:
    """Return a body's path (n, 3) [m], NaN where it was not seen."""
    path = body.position if known(body.position).any() else body.centroid_solved
    return np.where(body.seen[:, None], path, np.nan)


def _around(
    exchanged: NDArray[np.bool_], whole: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (n,) where bodies are exchanged, also while only one is seen, and where it is unsure.

    A lone body between two samples that show both is as in both of them; where they disagree, its
    identity is unknown.
    """
    rows = np.flatnonzero(whole)
    after = np.searchsorted(rows, np.arange(len(whole)))
    next_is = exchanged[rows[np.minimum(after, len(rows) - 1)]]
    last_is = exchanged[rows[np.maximum(after - 1, 0)]]
    return (np.where(whole, exchanged, next_is & last_is), ~whole & (next_is != last_is))


def _swapped(a: BodyTake, b: BodyTake, rows: NDArray[np.bool_]) -> tuple[BodyTake, BodyTake]:
    """Return two bodies with what they have in some samples exchanged."""

    def mixed(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        mine, other = getattr(a, name), getattr(b, name)
        where = rows.reshape(-1, *(1,) * (mine.ndim - 1))
        if mine.shape != other.shape:  # markers of another count say nothing of this body
            return np.where(where, np.nan, mine), np.where(where, np.nan, other)
        return np.where(where, other, mine), np.where(where, mine, other)

    fields = ["position", "quaternion", "measured", "solved", "missing"]
    for optional in ("reported_error", "marker_quality"):
        if getattr(a, optional) is not None and getattr(b, optional) is not None:
            fields.append(optional)
    both = {name: mixed(name) for name in fields}
    return (
        replace(a, **{name: pair[0] for name, pair in both.items()}),
        replace(b, **{name: pair[1] for name, pair in both.items()}),
    )
