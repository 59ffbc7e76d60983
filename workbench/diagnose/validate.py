"""What an extension gains, on runs that no fit has seen, read again from the file that was written.

The robot is simulated freely, its rotor turned by the command through what is said of the drive;
a hop only up to its first hops, for then it is chaotic. What a run alone knows, such as when it was
let go, is fitted for base and extension alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import Estimator, Hopper, MeasuredRun, ParameterVector, minimised
from workbench.fit.fitting import refined
from workbench.fit.prediction import prediction_errors
from workbench.fit.state import observed
from workbench.identify.validation import compared_s
from workbench.sim import Robot

__all__ = ["Errors", "errors_of", "removed"]

Array = NDArray[np.float64]

_REMOVABLE = 1.05  # times the noise: below this the base leaves nothing to remove
_AHEAD = ("0.1", "0.5", "2")


@dataclass(frozen=True, eq=False)
class Errors:
    """How far runs are from a model's prediction.

    Args:
        by_run: run -> root mean square [mm], or in the channel's unit where none is a length.
        noise_floor: what the cameras' noise makes of it.
        unit: of both.
        predicted: run -> (n, c) of the observed channels, free simulation.
        ahead: time ahead [s] -> root mean square error of predictions from the observed state [mm].
    """

    by_run: Mapping[str, float]
    noise_floor: float
    unit: str
    predicted: Mapping[str, Array]
    ahead: Mapping[str, float | None]

    @property
    def rmse(self) -> float:
        """Return the root mean square over all runs."""
        return float(np.sqrt(np.mean(np.square(list(self.by_run.values())))))


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
        turned: of each, the rotor's angle against T as the drive is said to make it [rad], from
            the run's first observed sample on; None where nothing drives it.
        threads: 0 takes all cores.
    """
    by_run, floors, predicted = {}, [], {}
    ahead: dict[str, list[float]] = {key: [] for key in _AHEAD}
    for run, angle in zip(runs, turned, strict=True):
        until = compared_s(run)
        part = replace(run, motion=run.motion.between(-np.inf, until))
        places = len(run.places)
        system = Hopper(robot, [part])
        if angle is not None:
            system = system.turning([angle[: len(system.seen(0))]])
        vector = ParameterVector(system.parameters)
        x = np.zeros(len(vector))
        free = Estimator.of(system, vector, system.strong, threads=threads).uncorrected()
        masks = refined(free, x).masks
        free = replace(free, masks=masks)
        (one,) = free.innovations(minimised(free, x).x)
        by_run[run.name] = 1000 * float(np.sqrt(np.nanmean(one.error[:, :places] ** 2)))
        floors.append(1000 * float(np.sqrt(np.mean(system.sigma(0)[:places] ** 2))))
        predicted[run.name] = system.seen(0) - one.error
        for key, value in _predictions(run, robot).items():
            ahead[key].append(value)
    floor = float(np.sqrt(np.mean(np.square(floors))))
    means = {
        key: float(np.sqrt(np.mean(np.square(values)))) if values else None
        for key, values in ahead.items()
    }
    return Errors(by_run, floor, "mm", predicted, means)


def _predictions(run: MeasuredRun, robot: Robot) -> dict[str, float]:
    """Return time ahead -> error of predictions [mm]; nothing where the run cannot be observed."""
    try:
        told = prediction_errors(observed(Hopper(robot, [run]), coarse=True))
    except InputError:
        return {}
    return {f"{s:g}": float(mm) for s, mm in told.items() if np.isfinite(mm)}
