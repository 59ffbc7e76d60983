"""Bodies of exports that hold points only, by their markers' labels."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.source import Source, listed
from workbench.tracking.take import BodyTake, SampleStatus, known

__all__ = [
    "MAKE_BODIES",
    "bodies_by_label",
    "marker_name",
    "merge",
    "owners_of",
    "side_by_side",
    "warn_of_no_bodies",
]

Array = NDArray[np.float64]

MAKE_BODIES = (
    "make rigid bodies Foot, T and Rotor in Motive, or label the markers there as Foot:Marker1 and "
    "so on, and export again"
)
"""Advice for a take with markers and no bodies."""

_LABEL = re.compile(
    r"(?P<body>.*\S)\s*(?:"
    r"[:_-]\s*(?P<numbered>marker[ _]?[0-9]{1,9})"  # Foot_Marker1, Foot:Marker 001, Foot-Marker 1
    r"|_(?P<number>[0-9]{1,9})"  # Foot_1
    r"|:\s*(?P<named>[^:]*\S))",  # Foot:heel
    re.IGNORECASE | re.ASCII,
)
_NUMBERED = re.compile(r"(?:marker)?[ _]?0*([0-9]{1,9})", re.IGNORECASE | re.ASCII)
_NO_BODY = ("unlabeled", "unlabelled", "active", "passive")


def bodies_by_label(
    labels: Sequence[str], points: Array, source: Source
) -> tuple[dict[str, BodyTake], list[int]]:
    """Group points into bodies that have measured markers and no pose.

    Args:
        labels: k names of points.
        points: (n, k, 3) their positions [m], NaN where not seen.
        source: for warnings.

    Returns:
        The bodies by name, seen where at least one marker is; the indices of the other labels.
    """
    owners = owners_of(labels)
    bodies: dict[str, BodyTake] = {}
    for owner in dict.fromkeys(filter(None, owners)):
        indices = [k for k, name in enumerate(owners) if name == owner]
        names = [marker_name(labels[k].strip().removeprefix(owner)) for k in indices]
        slots = tuple(dict.fromkeys(names))
        paths: dict[str, Array] = {}
        for k, slot in zip(indices, names, strict=True):
            merge(paths, slot, points[:, k], labels[k], source)
        bodies[owner] = _unposed(owner, slots, side_by_side(paths, slots, len(points)))
    return bodies, [k for k, owner in enumerate(owners) if not owner]


def owners_of(labels: Sequence[str]) -> list[str]:
    """Return the body that each label names, empty where it names none."""
    found = [_LABEL.fullmatch(label.strip()) for label in labels]
    owners = ["" if match is None else match["body"] for match in found]
    return ["" if owner.casefold() in _NO_BODY else owner for owner in owners]


def warn_of_no_bodies(labels: Iterable[str], points: Array, line: int, source: Source) -> None:
    """Warn that a file holds markers alone, and what to do.

    Args:
        labels: of the markers.
        points: (n, k, 3) their positions [m], NaN where not seen.
        line: of the header that names them, for the message.
        source: for the warning.

    Raises:
        TakeError: no marker is ever seen either.
    """
    if not known(points).any():
        raise source.fault(line, "there are no rigid bodies, and no marker is ever seen")
    source.warn(
        "there are no rigid bodies, and no label like 'Foot:Marker1' names one; the markers are "
        f"named {listed(labels)}: {MAKE_BODIES}"
    )


def marker_name(rest: str) -> str:
    """Return a marker's name on its body, the same for `_1`, `_Marker1` and `:Marker 001`."""
    plain = rest.strip().lstrip("_:- ")
    number = _NUMBERED.fullmatch(plain)
    return f"Marker {number[1]}" if number else plain


def merge(paths: dict[str, Array], slot: str, found: Array, label: str, source: Source) -> None:
    """Add one column's samples to a marker's path; it may continue in a second column.

    Args:
        paths: (n, 3) of each marker, added to [m].
        slot: of the marker.
        found: (n, 3) samples [m].
        label: of the column.
        source: that is warned.
    """
    if slot not in paths:
        paths[slot] = found
        return
    free = ~known(paths[slot])
    both = int(np.count_nonzero(~free & known(found)))
    if both:
        source.warn(
            f"marker {label!r} has columns that hold samples at the same time, {both} in all; "
            "the first one counts"
        )
    paths[slot] = np.where(free[:, None], found, paths[slot])


def side_by_side(paths: dict[str, Array], slots: Sequence[str], n: int) -> Array:
    """Return (n, k, 3) [m], NaN for a marker without a path.

    Args:
        paths: (n, 3) of each marker [m].
        slots: the k markers.
        n: samples.
    """
    given = [paths[slot] for slot in slots if slot in paths]
    if given and len(given) == len(slots) and (view := _evenly_apart(given)) is not None:
        return view
    columns = np.full((len(slots), 3, n), np.nan)  # samples run along the last axis, as paths have
    for column, slot in zip(columns, slots, strict=True):
        if slot in paths:
            column[:] = paths[slot].T
    return columns.transpose(2, 0, 1)


def _evenly_apart(paths: Sequence[Array]) -> Array | None:
    """Return paths (n, 3) side by side without a copy, where they lie so in one table.

    None where they do not. Markers are most of a long take.
    """
    first = paths[0]
    starts = [path.__array_interface__["data"][0] for path in paths]
    steps = set(np.diff(starts).tolist()) or {0}
    alike = all(p.base is first.base and p.strides == first.strides for p in paths)
    if first.base is None or not alike or len(steps) != 1 or min(steps) < 0:
        return None
    along, across = first.strides
    return np.lib.stride_tricks.as_strided(
        first, (len(first), len(paths), 3), (along, steps.pop(), across), writeable=False
    )


def _unposed(name: str, slots: tuple[str, ...], measured: Array) -> BodyTake:
    n = len(measured)
    seen = known(measured).any(axis=1)
    return BodyTake(
        name=name,
        id=name,
        position=np.full((n, 3), np.nan),
        quaternion=np.full((n, 4), np.nan),
        measured=measured,
        solved=np.full_like(measured, np.nan),
        marker_names=slots,
        missing=np.where(seen, SampleStatus.SEEN, SampleStatus.BLANK).astype(np.int8),
    )
