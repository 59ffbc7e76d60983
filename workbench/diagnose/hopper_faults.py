"""Runs of the hopping robot that are not what they are said to be, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.body_faults import Expected, body_faults
from workbench.diagnose.drive_faults import drive_faults
from workbench.diagnose.release_faults import release_faults
from workbench.diagnose.rig import Fault, Rig
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, TOP

__all__ = ["hopper_faults"]

_FIRST_S = 0.05  # of a run: it has hardly moved
_HOPPED_S = 1.0  # of a hop, until a foot that is free has moved
_STILL = {"gain": -1.0}
_UNPULLED = {"pull": -1.0}


def hopper_faults(rig: Rig, runs: Sequence[MeasuredRun]) -> list[Fault]:
    """Return which runs are not what they are said to be.

    Args:
        rig: predicts what the model as stated does in each run.
        runs: as measured, in the rig's order.
    """
    drive = drive_faults(runs)
    misdriven = {fault.run for fault in drive}
    expected = _expected(rig, runs, misdriven)
    bodies = body_faults(runs, expected)
    told = {fault.run for fault in bodies}  # whose drive or release would only show the same again
    releases = release_faults(runs, expected, [k for k in range(len(runs)) if k not in told])
    return [*bodies, *(fault for fault in drive if fault.run not in told), *releases]


def _expected(rig: Rig, runs: Sequence[MeasuredRun], misdriven: set[int]) -> list[Expected]:
    held = rig.predict([(k, _STILL if run.driven else {}) for k, run in enumerate(runs)], _FIRST_S)
    tops = [_top_from_foot(path, run) for path, run in zip(held, runs, strict=True)]
    pulled = [k for k, run in enumerate(runs) if run.mode == "decay"]
    free = dict(zip(pulled, rig.predict([(k, _UNPULLED) for k in pulled], _FIRST_S), strict=True))
    hops = [k for k, run in enumerate(runs) if run.mode == "hop" and k not in misdriven]
    hopped = dict(zip(hops, rig.predict([(k, {}) for k in hops], _HOPPED_S), strict=True))
    return [
        Expected(
            top,
            _top_from_foot(free[k], runs[k]) if k in free else top,
            _foot_way(hopped[k]) if k in hopped else 0.0,
        )
        for k, top in enumerate(tops)
    ]


def _top_from_foot(path: NDArray[np.float64], run: MeasuredRun) -> NDArray[np.float64]:
    """Return where T is at first, from the foot, (2,) [m]; NaN where the run has no beginning."""
    if not len(path):
        return np.full(2, np.nan)
    at = dict(zip(run.channels, path[0], strict=True))
    return np.array([at[TOP[axis]] - at.get(FOOT[axis], 0.0) for axis in (0, 2)])


def _foot_way(path: NDArray[np.float64]) -> float:
    """Return the root mean square way of a hop's foot from its start [m]."""
    return float(np.sqrt(np.mean(np.sum((path[:, :2] - path[0, :2]) ** 2, axis=1))))
