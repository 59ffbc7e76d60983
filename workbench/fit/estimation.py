"""What the observer makes of one run: its estimated state, and how well it was predicted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun
from workbench.fit.prediction import free_motion, prediction_errors
from workbench.fit.state import observed, state_of
from workbench.fit.systems.hopper import Hopper
from workbench.motion import FOOT, misfit
from workbench.sim import SAMPLE_RATE_HZ, Robot
from workbench.timeseries import TimeSeries

__all__ = ["Estimation", "estimate", "paced"]

_LEAST_S = 0.5
_PACE = 0.01  # by how much the cameras' rate may differ from the observer's


@dataclass(frozen=True, eq=False)
class Estimation:
    """What the observer makes of a run.

    Args:
        state: of `fit.state.estimated_state`.
        prediction_mm: horizon in seconds -> error of a prediction [mm], None where there is none.
        measured_input_mm: root mean square distance of foot and T, or of T alone where the foot is
            held, from a free simulation whose rotor turns, and whose release is, as measured [mm];
            None where it ended early.
    """

    state: TimeSeries
    prediction_mm: Mapping[str, float | None]
    measured_input_mm: float | None

    def as_json(self) -> dict[str, object]:
        """Return the numbers for a manifest."""
        return {
            "prediction_mm": dict(self.prediction_mm),
            "measured_input_mm": self.measured_input_mm,
        }


def estimate(robot: Robot, run: MeasuredRun) -> Estimation:
    """Observe a run with a model of the robot.

    A driven run is observed in coarse steps: they follow it as well, in half the time.

    Raises:
        InputError: when it cannot be observed: no rest, too short, a robot that was lost or that
            the model does not follow.
    """
    run = replace(run, motion=paced(run.motion, run.name))
    try:
        one = observed(Hopper(robot, [run]), coarse=run.driven)
        with np.errstate(over="ignore"):  # of numbers that blew up
            errors = prediction_errors(one)
        free = free_motion(one)
        state = state_of(one)
    except (ArithmeticError, ValueError) as error:
        raise InputError(f"{run.name}: cannot be observed: {error}") from error
    apart = misfit(run.motion, free, float(run.motion.times[-1]))
    seen = apart.both_mm if FOOT[0] in run.places else apart.top_mm
    whole = len(free) == len(one.job.seen)
    return Estimation(
        state,
        {f"{seconds:g}": _number(mm) for seconds, mm in errors.items()},
        _number(seen) if whole else None,
    )


def paced(motion: TimeSeries, name: str) -> TimeSeries:
    """Return a motion at the observer's rate: every so many samples, missing ones not valid.

    Raises:
        InputError: when its own rate is no multiple of that, or it is too short.
    """
    times = motion.times
    if len(times) < 2 or times[-1] < _LEAST_S:
        raise InputError(f"{name}: less than {_LEAST_S:g} s were seen after the first motion")
    step = float(np.median(np.diff(times)))
    every = max(1, round(1 / (SAMPLE_RATE_HZ * step)))
    if abs(every * step * SAMPLE_RATE_HZ - 1) > _PACE:
        raise InputError(
            f"{name}: {1 / step:.0f} samples a second; the observer takes a multiple of "
            f"{SAMPLE_RATE_HZ}"
        )
    step *= every
    own = step / every
    grid = times[0] + step * np.arange(int((times[-1] - times[0] + own / 2) / step) + 1)
    nearest = np.clip(np.searchsorted(times, grid - own / 2), 0, len(times) - 1)
    there = np.abs(times[nearest] - grid) < own / 2
    return TimeSeries(
        grid, motion.values[nearest], motion.names, motion.valid[nearest] & there[:, None]
    )


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
