"""Validation: how far two models are from runs that no fit has seen (thesis, 4.5 and 4.6).

Each run is simulated with the stated and with the fitted model. Both may choose what nobody wrote
down about the run, when it began and how its motor ran, and no parameter; a wrong model gets the
same benefit of the doubt. Clamped, decay and drop runs are compared whole; a hop is compared up to
its first hops, and by the statistics of its hops from there on, since what it does then cannot be
reproduced even by the robot itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun
from workbench.identify.events import EventTest, compare_events, twins
from workbench.identify.excitation import first_slip
from workbench.identify.problem import LEAD_S, Problem
from workbench.identify.solution import ROBUST
from workbench.motion import FOOT, TOP
from workbench.protocol import ModelFile, ShapeFile
from workbench.sim import Robot, make_robot, simulate_all

__all__ = ["NOT_VALIDATED", "PointError", "RunValidation", "Validation", "validate"]

NOT_VALIDATED = (
    "nothing was validated: no run has role held_out; give one run of each kind that role and "
    "repeat"
)

_AFTER_SLIP_S = 0.75
_MOST_HOP_S = 3.0
_REMOVABLE = 1.05  # times the noise: below this the stated model leaves nothing to remove
_POINTS = {"foot": FOOT, "T": TOP}


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
        stated_events: of a hop from there on, the stated model's; empty where it does not hop.
        fitted_events: the fitted model's.
    """

    name: str
    mode: str
    window: float
    points: tuple[PointError, ...]
    stated_events: tuple[EventTest, ...] = ()
    fitted_events: tuple[EventTest, ...] = ()


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
                    "events": {
                        old.name: {"stated": old.as_json(), "fitted": new.as_json()}
                        for old, new in zip(run.stated_events, run.fitted_events, strict=False)
                    },
                }
                for run in self.runs
            ],
        }

    def __str__(self) -> str:
        """Return a table: each run's points, the hops' events, and all together."""
        pooled = self.pooled
        if pooled is None:
            return NOT_VALIDATED
        lines = [f"{'held-out run':32}{'':10}{'noise':>9}{'stated':>9}{'fitted':>9}{'removed':>9}"]
        for run in self.runs:
            lines += [_line(run.name, point) for point in run.points]
            lines += [
                f"  {old.name:40}{old.measured:9.4g}{old.simulated:9.4g}{new.simulated:9.4g}"
                f"  measured, stated, fitted; +- {new.error:.2g}"
                for old, new in zip(run.stated_events, run.fitted_events, strict=False)
            ]
        return "\n".join([*lines, _line("all", pooled)])


def validate(
    runs: Sequence[MeasuredRun],
    stated: ModelFile,
    fitted: ModelFile,
    shape: ShapeFile,
    *,
    seed: int = 0,
    threads: int = 0,
) -> Validation:
    """Compare a stated and a fitted model on runs that were held out.

    Args:
        runs: with role `held_out`.
        stated: the model before the fit.
        fitted: the model after it, best read again from its file.
        shape: of the beam in the runs.
        seed: of the twins' starts, for the statistics of the hops.
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
    return Validation(tuple(_validated(run, robots, seed, threads) for run in runs))


def _validated(run: MeasuredRun, robots: Sequence[Robot], seed: int, threads: int) -> RunValidation:
    window = float(run.motion.times[-1])
    if run.mode == "hop":
        window = min(window, _MOST_HOP_S, first_slip(run) + _AFTER_SLIP_S)
    problems = [Problem([run], robot, (), window, threads) for robot in robots]
    ends = [_own_unknowns(problem) for problem in problems]
    errors = [_distances(p, x) for p, x in zip(problems, ends, strict=True)]
    points = tuple(
        _point(problems[0], name, errors[0][name], errors[1][name]) for name in errors[0]
    )
    events: list[tuple[EventTest, ...]] = [(), ()]
    if run.mode == "hop":
        whole = [Problem([run], robot, (), threads=threads) for robot in robots]
        events = [_events(p, x, window, seed) for p, x in zip(whole, ends, strict=True)]
        if not all(events):
            events = [(), ()]
    return RunValidation(run.name, run.mode, window, points, *events)


def _events(
    problem: Problem, x: NDArray[np.float64], start: float, seed: int
) -> tuple[EventTest, ...]:
    jobs = [(problem.robot, condition) for condition in twins(problem.condition(0, x), seed)]
    done = simulate_all(jobs, problem.threads)
    motions = [simulation.motion.shifted(-LEAD_S) for simulation in done]
    return compare_events(problem.runs[0], motions, start, seed)


def _own_unknowns(problem: Problem) -> NDArray[np.float64]:
    """Return what the run keeps to itself as this model explains it best, (u,)."""
    found = scipy.optimize.least_squares(
        problem.residuals,
        problem.start,
        jac=problem.jacobian,  # pyright: ignore[reportArgumentType]  # the stub omits functions
        loss="soft_l1",
        f_scale=ROBUST,
        ftol=1e-4,
        max_nfev=12,
    )
    return np.asarray(found.x)


def _distances(problem: Problem, x: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Return the distance of each point at each sample, (n,) [m], NaN where it was not seen."""
    run, seen = problem.runs[0], problem.seen[0]
    first = len(seen.rest)
    parted = problem.residuals(x)[first : first + seen.values.size].reshape(seen.values.shape)
    apart = np.where(seen.valid, parted * seen.sigma, np.nan)
    return {
        name: np.hypot(*(apart[:, run.channels.index(c)] for c in channels[::2]))
        for name, channels in _POINTS.items()
        if channels[0] in run.places
    }


def _point(
    problem: Problem, name: str, stated: NDArray[np.float64], fitted: NDArray[np.float64]
) -> PointError:
    run, seen = problem.runs[0], problem.seen[0]
    index = [run.channels.index(channel) for channel in _POINTS[name][::2]]
    path = np.where(seen.valid, seen.values, np.nan)[:, index]
    return PointError(
        point=name,
        stated_mm=_rms_mm(stated),
        fitted_mm=_rms_mm(fitted),
        noise_mm=1000 * float(np.hypot(*seen.sigma[index])),
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
