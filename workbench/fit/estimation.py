"""What the observer makes of one run: its estimated state, and how well it was predicted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun, paced
from workbench.fit.prediction import prediction_errors
from workbench.fit.replay import compared, compared_s, replayed
from workbench.fit.state import observed, state_of
from workbench.fit.systems.hopper import Hopper
from workbench.sim import Robot
from workbench.timeseries import TimeSeries

__all__ = ["Estimation", "estimate"]


@dataclass(frozen=True, eq=False)
class Estimation:
    """What the observer makes of a run.

    Args:
        state: of `fit.state.estimated_state`.
        prediction_mm: horizon in seconds -> error of a prediction [mm], None where there is none.
        compared_s: until when free simulations are compared [s]: a hop to its first hops.
        measured_input_mm: root mean square distance of foot and T, or of T alone where the foot is
            held, from a free simulation whose rotor turns as measured [mm]; None of a run that is
            not driven, or where the simulation ended early.
        measured_start_mm: the same where it starts as measured, too: where foot and T rested, or
            as they were released.
        noise_mm: what the cameras' noise alone makes of these.
    """

    state: TimeSeries
    prediction_mm: Mapping[str, float | None]
    compared_s: float
    measured_input_mm: float | None
    measured_start_mm: float | None
    noise_mm: float


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
        state, until = state_of(one), compared_s(run)
        free = replayed(robot, compared(run), threads=1)
    except (ArithmeticError, ValueError) as error:
        raise InputError(f"{run.name}: cannot be observed: {error}") from error
    whole = len(free.motion) == len(free.error)
    return Estimation(
        state,
        {f"{seconds:g}": _number(mm) for seconds, mm in errors.items()},
        until,
        _number(free.unlaid_mm) if whole and run.driven else None,
        _number(free.rms_mm) if whole else None,
        free.noise_mm,
    )


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
