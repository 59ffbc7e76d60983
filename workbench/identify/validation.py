"""Validation: how far two models are from runs that no fit has seen (thesis, 4.5 and 4.6).

Each run is simulated freely with the stated and with the fitted model, its rotor turned as it was
seen to turn. Both may choose what nobody wrote down about the run, such as when it was let go, and
no parameter; a wrong model gets the same benefit of the doubt. Clamped, decay and drop runs are
compared whole, a hop up to its first hops: what it does then cannot be reproduced even by the robot
itself. How well it was predicted is given for every run, from the observed state some time ahead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import Hopper, MeasuredRun, compared, compared_s, paced, predictions, replayed
from workbench.motion import TOP_ERROR
from workbench.schemas import ModelFile, ShapeFile
from workbench.sim import Robot, make_robot

__all__ = ["NOT_VALIDATED", "PointError", "RunValidation", "Validation", "validate"]

NOT_VALIDATED = (
    "nothing was validated: no run has role held_out; give one run of each kind that role and "
    "repeat"
)

_REMOVABLE = 1.05  # times the noise: below this the stated model leaves nothing to remove


@dataclass(frozen=True)
class PointError:
    """How far a point of two models is from where it was seen, in the hopping plane.

    Args:
        point: `foot`, `T`, or `all` where pooled.
        stated_mm: root mean square distance of the stated model.
        fitted_mm: of the fitted model.
        noise_mm: of the cameras: what a perfect model leaves.
        amplitude_mm: root mean square of the measured motion about its mean.
        samples: over how many.
    """

    point: str
    stated_mm: float
    fitted_mm: float
    noise_mm: float
    amplitude_mm: float
    samples: int

    @property
    def removed(self) -> float:
        """Return the part of the removable error that is gone; NaN where nothing is removable."""
        removable = self.stated_mm - self.noise_mm
        if self.stated_mm < _REMOVABLE * self.noise_mm:
            return float("nan")
        return (self.stated_mm - self.fitted_mm) / removable

    def as_json(self) -> dict[str, float | str | None]:
        """Return errors in mm, in percent of the motion and over the noise."""
        share = 100 / self.amplitude_mm if self.amplitude_mm else 0.0
        return {
            "point": self.point,
            "noise_floor_mm": self.noise_mm,
            "stated_mm": self.stated_mm,
            "fitted_mm": self.fitted_mm,
            "stated_percent": share * self.stated_mm,
            "fitted_percent": share * self.fitted_mm,
            "stated_over_noise": self.stated_mm / self.noise_mm,
            "fitted_over_noise": self.fitted_mm / self.noise_mm,
            "removable_removed": self.removed if np.isfinite(self.removed) else None,
        }


@dataclass(frozen=True)
class RunValidation:
    """One run against both models.

    Args:
        name: of the run.
        mode: what the robot did.
        window: how much of it was compared sample by sample [s].
        points: T, and the foot where it is free.
        predicted: time ahead [s] -> error of the stated and of the fitted model's predictions [mm],
            camera noise included; None where the model cannot follow the run, or it is too short.
    """

    name: str
    mode: str
    window: float
    points: tuple[PointError, ...]
    predicted: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)


@dataclass(frozen=True)
class Validation:
    """What runs that no fit has seen say about two models.

    Args:
        runs: each of them; empty where there was none, and then nothing is validated.
    """

    runs: tuple[RunValidation, ...]

    @property
    def pooled(self) -> PointError | None:
        """Return the errors over all samples of all points, None without a run."""
        points = [point for run in self.runs for point in run.points]
        return _pooled(points) if points else None

    def as_json(self) -> dict[str, object]:
        """Return the pooled and the single errors, as the command line prints them."""
        pooled = self.pooled
        if pooled is None:
            return {"held_out_runs": [], "validated": False, "why": NOT_VALIDATED}
        gain = pooled.removed
        return {
            "held_out_runs": [run.name for run in self.runs],
            "validated": True,
            "rmse_mm": {
                "noise_floor": pooled.noise_mm,
                "stated": pooled.stated_mm,
                "fitted": pooled.fitted_mm,
            },
            "removable_removed": gain if np.isfinite(gain) else None,
            "runs": [
                {
                    "run": run.name,
                    "mode": run.mode,
                    "window_s": run.window,
                    "points": [point.as_json() for point in run.points],
                    "prediction_mm": {
                        ahead: {"stated": stated, "fitted": fitted}
                        for ahead, (stated, fitted) in run.predicted.items()
                    },
                }
                for run in self.runs
            ],
        }

    def __str__(self) -> str:
        """Return a table: each run's points, its predictions, and all together."""
        pooled = self.pooled
        if pooled is None:
            return NOT_VALIDATED
        lines = [f"{'held-out run':32}{'':10}{'noise':>9}{'stated':>9}{'fitted':>9}{'removed':>9}"]
        for run in self.runs:
            lines += [_line(run.name, point) for point in run.points]
            lines += [
                f"{'  ' + ahead + ' s ahead':32}{'[mm]':10}{'':9}{_mm(stated):>9}{_mm(fitted):>9}"
                for ahead, (stated, fitted) in run.predicted.items()
            ]
        return "\n".join([*lines, _line("all", pooled)])


def validate(
    runs: Sequence[MeasuredRun],
    stated: ModelFile,
    fitted: ModelFile,
    shape: ShapeFile,
    *,
    threads: int = 0,
) -> Validation:
    """Compare a stated and a fitted model on runs that were held out.

    Args:
        runs: with role `held_out`.
        stated: the model before the fit.
        fitted: the model after it, best read again from its file.
        shape: of the beam in the runs.
        threads: 0 takes all cores.

    Raises:
        InputError: a run that a fit may have seen.
    """
    for run in runs:
        if run.role != "held_out":
            raise InputError(
                f"run {run.name} has role {run.role}; a model is validated on runs with role "
                "held_out only, since a fit has seen the others"
            )
    robots = [make_robot(m.values(), shape, m.increments) for m in (stated, fitted)]
    return Validation(tuple(_validated(paced(run), robots, threads) for run in runs))


def _validated(run: MeasuredRun, robots: Sequence[Robot], threads: int) -> RunValidation:
    window = compared_s(run)
    part = compared(run)
    apart = [replayed(robot, part, threads=threads).error for robot in robots]
    system = Hopper(robots[0], [part])
    points = tuple(
        _point(system, k, column, *(one[column] / 1000 for one in apart))
        for k, column in enumerate(apart[0].names)
    )
    base, fitted = (predictions(robot, run) for robot in robots)
    ahead = {key: (base.get(key), fitted.get(key)) for key in {**base, **fitted}}
    return RunValidation(run.name, run.mode, window, points, ahead)


def _point(
    system: Hopper, k: int, column: str, stated: NDArray[np.float64], fitted: NDArray[np.float64]
) -> PointError:
    path, sigma = system.seen(0)[:, 2 * k : 2 * k + 2], system.sigma(0)[2 * k : 2 * k + 2]
    return PointError(
        point="T" if column == TOP_ERROR else "foot",
        stated_mm=_rms_mm(stated),
        fitted_mm=_rms_mm(fitted),
        noise_mm=1000 * float(np.hypot(*sigma)),
        amplitude_mm=_rms_mm(np.hypot(*(path - np.nanmean(path, axis=0)).T)),
        samples=int(np.isfinite(stated).sum()),
    )


def _pooled(points: Sequence[PointError]) -> PointError:
    weights = [point.samples for point in points]

    def together(values: Sequence[float]) -> float:
        return float(np.sqrt(np.average(np.square(values), weights=weights)))

    return PointError(
        "all",
        together([point.stated_mm for point in points]),
        together([point.fitted_mm for point in points]),
        together([point.noise_mm for point in points]),
        together([point.amplitude_mm for point in points]),
        sum(weights),
    )


def _rms_mm(distances: NDArray[np.float64]) -> float:
    return 1000 * float(np.sqrt(np.nanmean(distances**2)))


def _line(name: str, point: PointError) -> str:
    removed = f"{100 * point.removed:7.1f} %" if np.isfinite(point.removed) else "    none"
    return (
        f"{name[:32]:32}{point.point + ' [mm]':10}{point.noise_mm:9.3f}{point.stated_mm:9.3f}"
        f"{point.fitted_mm:9.3f}{removed}"
    )


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
