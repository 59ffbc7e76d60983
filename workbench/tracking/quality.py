"""The quality of a raw take, before any cleaning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from workbench.errors import TakeError
from workbench.tracking.length_unit import unit_hint
from workbench.tracking.marker_tracks import MarkerTrack, marker_tracks
from workbench.tracking.missing import gaps
from workbench.tracking.reader import read_take
from workbench.tracking.take import SampleStatus, Take, known

__all__ = ["exports_in", "quality", "quality_or_error"]

_EXPORTS = (".csv", ".c3d", ".trc")


def quality(take: Take) -> dict[str, Any]:
    """Return the quality report of a raw take as a JSON object.

    Lengths in metres, times in seconds, the file's own axes, nothing filtered. The mean position
    is over the samples that count as seen; it is None when there is none. `reasons` counts the
    others by `SampleStatus`, `markers` the samples in which each measured marker was not visible,
    None where the file does not hold its measured places. `points` are the markers of a take
    without bodies: the ids that one of them had, the share of the take that does not show it, and
    where it was.
    """
    return {
        "format": take.format,
        "version": take.version,
        "rate_hz": take.rate_hz,
        "jitter_s": take.jitter_s,
        "frames": len(take),
        "first_time_s": float(take.times[0]),
        "last_time_s": float(take.times[-1]),
        "start_time": take.header.get("Capture Start Time"),
        "bodies": {name: _body(take, name) for name in take.bodies},
        "loose_points": take.cloud.position.shape[1],
        "points": []
        if take.bodies
        else [_point(take, track) for track in marker_tracks(take.cloud, take.rate_hz)],
        "warnings": [*take.warnings, *filter(None, [unit_hint(take)])],
    }


def exports_in(folder: Path) -> list[Path]:
    """Return the files of a folder that may be exports, by name."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in _EXPORTS)


def quality_or_error(path: Path) -> dict[str, Any]:
    """Return the quality report of an export; of one that cannot be read, why, under `error`."""
    try:
        return quality(read_take(path))
    except TakeError as error:
        return {"error": str(error)}


def _body(take: Take, name: str) -> dict[str, Any]:
    body = take.bodies[name]
    count, longest = gaps(body.seen)
    position = take.counted_position(name)
    position = position[body.seen & known(position)]
    mean = np.mean(position, axis=0) if len(position) else None
    hidden = np.count_nonzero(~known(body.measured), axis=0)
    reasons = {reason: int(np.count_nonzero(body.missing == reason)) for reason in SampleStatus}
    return {
        "missing": int(np.count_nonzero(~body.seen)),
        "gaps": count,
        "longest_gap": longest,
        "reasons": {
            reason.name.lower(): n
            for reason, n in reasons.items()
            if n and reason != SampleStatus.SEEN
        },
        "mean_position_m": None if mean is None else [float(x) for x in mean],
        "markers": {
            marker: None if marker in body.solved_only else count
            for marker, count in zip(body.marker_names, hidden.tolist(), strict=True)
        },
    }


def _point(take: Take, track: MarkerTrack) -> dict[str, Any]:
    count, longest = track.gaps(len(take))
    return {
        "names": list(track.names),
        "missing": len(take) - len(track.frames),
        "gaps": count,
        "longest_gap": longest,
        "mean_position_m": track.position.mean(axis=0).tolist(),
    }
