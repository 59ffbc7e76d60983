"""What the observer makes of one run: its estimated state, and how well it was predicted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun, paced
from workbench.fit.prediction import free_motion, prediction_errors
from workbench.fit.state import observed, state_of
from workbench.fit.systems.hopper import Hopper
from workbench.motion import FOOT, misfit
from workbench.sim import Robot
from workbench.timeseries import TimeSeries

__all__ = ["Estimation", "estimate"]


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


def estimate(robot: Robot, run: MeasuredRun) -> Estimation:
    """Observe a run with a model of the robot.

    A driven run is observed in coarse steps: they follow it as well, in half the time.

    Raises:
        InputError: when it cannot be observed: no rest, too short, a robot that was lost or that
            the model does not follow.
    """
    run = paced(run)
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


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
