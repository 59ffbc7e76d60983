"""Tracks of markers without a body: ids of one marker joined over occlusions.

A marker without a body gets a new id whenever it comes back into sight. An id that appears near the
position where another one vanished a moment before is the same marker.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.tracking.missing import gaps
from workbench.tracking.take import Cloud, known

__all__ = ["MarkerTrack", "marker_tracks"]

_LONGEST_S = 0.5
_NEAR_M = 0.03
_CLEAR = 2.0  # how much further away the next candidate has to be


class MarkerTrack(NamedTuple):
    """One marker of a take.

    Args:
        names: the ids it had, in their order.
        frames: (k,) indices of the samples that show it.
        position: (k, 3) in those [m].
    """

    names: tuple[str, ...]
    frames: NDArray[np.intp]
    position: NDArray[np.float64]

    def gaps(self, n: int) -> tuple[int, int]:
        """Return the number of gaps and the longest one, of a take of n samples."""
        seen = np.zeros(n, dtype=np.bool_)
        seen[self.frames] = True
        return gaps(seen)


def marker_tracks(cloud: Cloud, rate: float) -> list[MarkerTrack]:
    """Return the markers of a cloud, in the order in which they first appear.

    An id continues another one that was last seen at most 0.5 s before and 30 mm away, where no
    other candidate is less than twice as far off.

    Args:
        cloud: n samples.
        rate: of the take [Hz].
    """
    found: list[MarkerTrack] = []
    open_ends: list[int] = []
    for name, frames, position in sorted(_tracks(cloud), key=lambda track: track[1][0]):
        open_ends = [k for k in open_ends if frames[0] - found[k].frames[-1] <= _LONGEST_S * rate]
        free = [k for k in open_ends if found[k].frames[-1] < frames[0]]
        apart = [float(np.linalg.norm(found[k].position[-1] - position[0])) for k in free]
        order = np.argsort(apart)
        clear = len(order) == 1 or (len(order) > 1 and apart[order[1]] > _CLEAR * apart[order[0]])
        if clear and apart[order[0]] <= _NEAR_M:
            k = free[order[0]]
            before = found[k]
            found[k] = MarkerTrack(
                (*before.names, name),
                np.concatenate([before.frames, frames]),
                np.concatenate([before.position, position]),
            )
        else:
            open_ends.append(len(found))
            found.append(MarkerTrack((name,), frames, position))
    return found


def _tracks(cloud: Cloud) -> list[tuple[str, NDArray[np.intp], NDArray[np.float64]]]:
    """Return each id with the samples (k,) that show it and its positions there (k, 3)."""
    frame, slot = np.nonzero(known(cloud.position))
    codes: dict[str, int] = {}
    code = np.array(
        [codes.setdefault(str(name), len(codes)) for name in cloud.names[frame, slot]], dtype=int
    )
    order = np.argsort(code, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(code[order])) + 1) if len(order) else []
    position = cloud.position[frame, slot]
    names = list(codes)
    return [(names[code[part[0]]], frame[part], position[part]) for part in parts]
