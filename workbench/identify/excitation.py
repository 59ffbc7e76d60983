"""Whether the runs touch what a contact parameter acts on, seen in the tracks alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.fit.measured import MeasuredRun
from workbench.motion import FOOT, position

__all__ = ["first_slip", "lands", "unexcited"]

_LOW_M = 1e-3  # above its rest: a foot this low stands on all its corners
_SLIPPED_M = 1e-3
_LANDED_S = 0.5
_STILL_M = 1e-3
_RISEN_M = 2e-3
_SMOOTHED = 5  # samples of a running median; an impact lasts longer


def unexcited(names: Iterable[str], runs: Sequence[MeasuredRun]) -> dict[str, str]:
    """Return parameter -> why these runs cannot tell it.

    Args:
        names: contact parameters.
        runs: drops and hops.
    """
    reasons: dict[str, str] = {}
    slipped = any(run.mode == "hop" and np.isfinite(first_slip(run)) for run in runs)
    landed = any(lands(run) for run in runs)
    for name in names:
        if name.startswith("ground_") and not landed:
            reasons[name] = "the foot never lands in these runs; add a drop"
        if name.startswith("friction_") and not slipped:
            reasons[name] = (
                "the foot never slips in these runs; add a hop at a speed at which the robot "
                "travels"
            )
    return reasons


def first_slip(run: MeasuredRun) -> float:
    """Return when the foot, low on the ground, was first out of its place [s]; inf if never."""
    times, x, z = _path(run)
    driven = times > 0
    out = driven & (z < _LOW_M) & (np.abs(x) > _SLIPPED_M)
    if not out.any():
        return float("inf")
    # it left its place in the air, at the end of the last time that it stood in it
    stood = driven & (z < _LOW_M) & (np.abs(x) < _SLIPPED_M / 2) & (times < times[out][0])
    return float(times[stood][-1]) if stood.any() else 0.0


def lands(run: MeasuredRun) -> bool:
    """Tell whether the foot comes down on the ground and stays, or rises and comes back."""
    times, _, z = _path(run)
    if run.mode == "drop":
        end = z[times > _LANDED_S]
        return len(end) > 0 and bool(np.nanmean(end) < -run.height / 2
                                     and np.nanstd(end) < _STILL_M)  # fmt: skip
    risen = np.flatnonzero((times > 0) & (z > _RISEN_M))
    return len(risen) > 0 and bool((z[risen[0] :] < _RISEN_M / 2).any())


def _path(
    run: MeasuredRun,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return times [s], and the foot's x and z against its rest, without noise peaks [m]."""
    path = position(run.motion, FOOT)[:, [0, 2]]
    seen = np.isfinite(path).all(axis=1)
    times, path = run.motion.times[seen], path[seen]
    if len(times) < _SMOOTHED:
        return times, np.zeros(len(times)), np.zeros(len(times))
    before = times <= 0
    path = path - (np.median(path[before], axis=0) if before.any() else path[0])
    smooth = np.lib.stride_tricks.sliding_window_view(path, _SMOOTHED, axis=0)
    x, z = np.median(smooth, axis=-1).T
    edge = _SMOOTHED // 2
    return times[edge:-edge], x, z
