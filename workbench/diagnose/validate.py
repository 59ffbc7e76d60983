"""What an extension gains, on runs that no fit has seen, read again from the file that was written.

The robot is simulated freely (`fit.replay`), its rotor turned as it was measured; where the drive
is at fault, by the command through what is said of the drive. A hop is compared up to its first
hops only, for then it is chaotic. What a run alone knows, such as when it was let go, is fitted for
base and extension alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.fit import MeasuredRun, Replay, compared, predictions, replayed
from workbench.sim import Robot
from workbench.timeseries import TimeSeries

__all__ = ["Errors", "errors_of", "removed", "root_mean_square"]

Array = NDArray[np.float64]

_REMOVABLE = 1.05  # times the noise: below this the base leaves nothing to remove
_AHEAD = ("0.1", "0.5", "2")


@dataclass(frozen=True, eq=False)
class Errors:
    """How far runs are from a model's prediction.

    Args:
        over_time: run -> distance of each point that is compared, or residual of each channel of
            another rig, by its name; not valid where it was not seen.
        noise: run -> root mean square of what the noise makes of it.
        unit: of both.
        predicted: run -> time ahead [s] -> root mean square error of predictions from the observed
            state [mm]; empty for another rig, or where a run could not be observed.
        motions: run -> motion of the whole robot; empty for another rig.
    """

    over_time: Mapping[str, TimeSeries]
    noise: Mapping[str, float]
    unit: str
    predicted: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    motions: Mapping[str, TimeSeries] = field(default_factory=dict)

    @cached_property
    def by_run(self) -> dict[str, float]:
        """Return the root mean square error of each run."""
        return {run: root_mean_square(one) for run, one in self.over_time.items()}

    @property
    def rmse(self) -> float:
        """Return the root mean square over all runs."""
        return float(np.sqrt(np.mean(np.square(list(self.by_run.values())))))

    @property
    def noise_floor(self) -> float:
        """Return what the noise makes of all runs."""
        return float(np.sqrt(np.mean(np.square(list(self.noise.values())))))

    @property
    def ahead(self) -> dict[str, float | None]:
        """Return time ahead [s] -> root mean square error of all predictions [mm]."""
        if not self.motions:
            return {}
        by_horizon = {key: [o[key] for o in self.predicted.values() if key in o] for key in _AHEAD}
        return {
            key: float(np.sqrt(np.mean(np.square(values)))) if values else None
            for key, values in by_horizon.items()
        }


def root_mean_square(error: TimeSeries) -> float:
    """Return the root mean square of all valid values."""
    return float(np.sqrt(np.mean(error.values[error.valid] ** 2)))


def removed(base: Errors, extended: Errors) -> float | None:
    """Return the share of the removable error that an extension removes; None of next to none."""
    if base.rmse < _REMOVABLE * base.noise_floor:
        return None
    share = (base.rmse - extended.rmse) / (base.rmse - base.noise_floor)
    return float(np.clip(share, -1.0, 1.0))


def errors_of(
    robot: Robot, runs: Sequence[MeasuredRun], turned: Sequence[Array | None], threads: int = 0
) -> Errors:
    """Return how far a robot is from runs.

    Args:
        robot: as read from its file.
        runs: held out.
        turned: (n,) of each, the rotor's angle against T as the drive is said to make it [rad],
            from the run's first observed sample on; None where it turned as it was seen, or not at
            all.
        threads: 0 takes all cores.
    """
    found: dict[str, Replay] = {}
    for run, angle in zip(runs, turned, strict=True):
        part = compared(run)
        found[run.name] = replayed(robot, part, angle, threads)
    return Errors(
        {name: one.error for name, one in found.items()},
        {name: one.noise_mm for name, one in found.items()},
        "mm",
        {run.name: predictions(robot, run) for run in runs},
        {name: one.motion for name, one in found.items()},
    )
