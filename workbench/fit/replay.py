"""A free simulation that starts and turns as was measured: what it is off is the model's.

Nothing is corrected on the way. A rotor's angle against T is an input; what only a released run
knows (its instant, where T was held, the height) is fitted, for a wrong model as for a right one.
Every channel has its origin where it rested.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.fit.estimator import Estimator
from workbench.fit.fitting import minimised, refined
from workbench.fit.measured import MeasuredRun
from workbench.fit.parameters import ParameterVector
from workbench.fit.state import pose, start_foot
from workbench.fit.systems.hopper import Hopper
from workbench.motion import FOOT, FOOT_ERROR, ROTOR, TOP_ERROR, position
from workbench.sim import Robot
from workbench.timeseries import TimeSeries

__all__ = ["Replay", "compared", "compared_s", "first_slip", "replayed"]

Array = NDArray[np.float64]

_EVALUATIONS = 4  # of what the run alone knows
_AFTER_SLIP_S = 0.75  # the first hops
_MOST_HOP_S = 3.0
_LOW_M = 1e-3  # above its rest: a foot this low stands on all its corners
_SLIPPED_M = 1e-3
_SMOOTHED = 5  # samples of a running median; an impact lasts longer


@dataclass(frozen=True, eq=False)
class Replay:
    """A model beside a run.

    Args:
        motion: of the whole robot, its rest laid upon the run's.
        error: `foot_error_mm` of a free foot and `top_error_mm`: distance in the hopping plane
            from where the cameras saw the point; not valid where they did not, or at a glitch.
        noise_mm: root mean square distance that the cameras' noise makes, over the same points.
        unlaid_mm: root mean square of all distances where the model rests at its own place.
    """

    motion: TimeSeries
    error: TimeSeries
    noise_mm: float
    unlaid_mm: float

    @property
    def rms_mm(self) -> float:
        """Return the root mean square of all distances [mm]."""
        return float(np.sqrt(np.mean(self.error.values[self.error.valid] ** 2)))

    def __repr__(self) -> str:
        """Return it in two lines: how far off, and what there is to look at."""
        seconds = float(self.error.times[-1])
        off = f"{self.rms_mm:.3g} mm rms from the run, {self.noise_mm:.3g} mm of them noise"
        return f"Replay of {seconds:.3g} s: {off}\n  motion: {self.motion!r}"


def replayed(
    robot: Robot, run: MeasuredRun, turned: Array | None = None, threads: int = 0
) -> Replay:
    """Simulate a run freely, started and turned as was measured.

    Args:
        robot: the model.
        run: as far as it is to be compared (`compared`).
        turned: (n,) angle of the rotor against T from the first observed sample on [rad]; as it was
            seen where left out. A longer one is cut.
        threads: 0 takes all cores.

    Raises:
        InputError: when the run cannot be observed.
    """
    system = Hopper(robot, [run])
    if turned is not None:
        system = system.turning([turned[: len(system.seen(0))]])
    vector = ParameterVector(system.parameters)
    x = np.zeros(len(vector))
    observer = refined(Estimator.of(system, vector, system.strong, threads=threads), x)
    if turned is not None:  # glitches are left out, but the angle stays as it was given
        observer = replace(observer, system=system)
    free = observer.uncorrected()
    if not run.driven:
        x = minimised(free, x, most=_EVALUATIONS).x
    (one,) = free.innovations(x, keep=True)
    return _replay(run, system, free, x, one.error, one.qpos[: one.sane])


def _replay(
    run: MeasuredRun, system: Hopper, free: Estimator, x: Array, error: Array, qpos: Array
) -> Replay:
    job, times, count = free.job(0, x), system.times(0), len(run.places)
    motion = pose(system.robot, job.model, times[: len(qpos)], qpos, start_foot(job))
    simulated = system.seen(0)[: len(qpos), :count] - error[: len(qpos), :count]
    columns = {name: motion[name] for name in motion.names}
    laid = np.zeros(count)
    for c, place in enumerate(run.places):
        laid[c] = np.nanmedian(simulated[:, c] - motion[place])
        columns[place] = columns[place] + laid[c]
    for c, name in enumerate((ROTOR[0], ROTOR[2]), start=count - 2):
        columns[name] = columns[name] + laid[c]
    unlaid = error[:, :count] + laid
    apart = 1000 * np.hypot(error[:, :count:2], error[:, 1:count:2])
    names = (TOP_ERROR,) if count == 2 else (FOOT_ERROR, TOP_ERROR)
    sigma = system.sigma(0)[:count]
    return Replay(
        TimeSeries.of(motion.times, columns),
        TimeSeries.of(times, dict(zip(names, apart.T, strict=True))),
        1000 * float(np.sqrt(np.sum(sigma**2) / (count // 2))),
        1000 * float(np.sqrt(2 * np.nanmean(unlaid**2))),
    )


def compared(run: MeasuredRun) -> MeasuredRun:
    """Return a run as far as it is compared with a free simulation: a hop to its first hops."""
    return replace(run, motion=run.motion.between(-np.inf, compared_s(run)))


def compared_s(run: MeasuredRun) -> float:
    """Return until when a run is compared with a free simulation [s]: a hop to its first hops."""
    window = float(run.motion.times[-1])
    if run.mode == "hop":
        window = min(window, _MOST_HOP_S, first_slip(run) + _AFTER_SLIP_S)
    return window


def first_slip(run: MeasuredRun) -> float:
    """Return when the foot, low on the ground, was first out of its place [s]; inf if never."""
    path = position(run.motion, FOOT)[:, [0, 2]]
    seen = np.isfinite(path).all(axis=1)
    times, path = run.motion.times[seen], path[seen]
    if len(times) < _SMOOTHED:
        return float("inf")
    still = times <= 0
    path = path - (np.median(path[still], axis=0) if still.any() else path[0])
    x, z = np.median(np.lib.stride_tricks.sliding_window_view(path, _SMOOTHED, axis=0), axis=-1).T
    edge = _SMOOTHED // 2
    times = times[edge:-edge]
    standing = (times > 0) & (z < _LOW_M)
    out = standing & (np.abs(x) > _SLIPPED_M)
    if not out.any():
        return float("inf")
    # it left its place in the air, at the end of the last time that it stood in it
    stood = standing & (np.abs(x) < _SLIPPED_M / 2) & (times < times[out][0])
    return float(times[stood][-1]) if stood.any() else 0.0
