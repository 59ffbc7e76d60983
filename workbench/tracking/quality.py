"""What a take is worth, before anyone cleans it."""

from __future__ import annotations

from typing import Any

import numpy as np

from workbench.tracking.missing import gaps
from workbench.tracking.take import Take, known

__all__ = ["quality"]


def quality(take: Take) -> dict[str, Any]:
    """Return the quality report of a raw take as a JSON object.

    Lengths in metres, times in seconds, the file's own axes, nothing filtered. The mean position
    is over the samples that count as seen; it is None when there is none.
    """
    return {
        "format": take.format,
        "version": take.version,
        "rate_hz": take.rate_hz,
        "frames": len(take),
        "first_time_s": float(take.times[0]),
        "last_time_s": float(take.times[-1]),
        "bodies": {name: _body(take, name) for name in take.bodies},
        "warnings": list(take.warnings),
    }


def _body(take: Take, name: str) -> dict[str, Any]:
    seen = take.bodies[name].seen
    count, longest = gaps(seen)
    position = take.counted_position(name)
    position = position[seen & known(position)]
    mean = np.mean(position, axis=0) if len(position) else None
    return {
        "missing": int(np.count_nonzero(~seen)),
        "gaps": count,
        "longest_gap": longest,
        "mean_position_m": None if mean is None else [float(x) for x in mean],
    }
