"""Runs of the hopping robot that nobody has made yet, as a rig wants them."""

from __future__ import annotations

from typing import cast

import numpy as np

from workbench.diagnose.rig import Trial
from workbench.fit import MeasuredRun
from workbench.motion import DRIVEN, FOOT, ROTOR_ANGLE, TOP, Mode
from workbench.sim import sample_times
from workbench.timeseries import TimeSeries

__all__ = ["imagined_run"]

_RAMP_S, _RAMP_STEP_S = 0.5, 0.1
"""How a supply reaches its voltage where a protocol says nothing else."""


def imagined_run(trial: Trial, start_angle: float) -> MeasuredRun:
    """Return a trial as a run whose every channel was seen to stay at zero.

    Args:
        trial: mode and amount are the protocol's.
        start_angle: of the rotor at rest [rad].
    """
    mode = cast(Mode, trial.mode)
    names = (*FOOT, *TOP, ROTOR_ANGLE)
    times = sample_times(trial.duration)
    values = np.zeros((len(times), len(names)))
    return MeasuredRun(
        name=f"{mode} {trial.amount:g}",
        mode=mode,
        motion=TimeSeries(times, values, names, np.ones(values.shape, dtype=bool)),
        steps=_ramp(trial.amount) if mode in DRIVEN else (),
        start_angle=start_angle,
        pull=trial.amount if mode == "decay" else 0.0,
        height=trial.amount if mode == "drop" else 0.0,
    )


def _ramp(speed: float) -> tuple[tuple[float, float], ...]:
    """Return (time [s], speed [rad/s]) in even steps up to a speed."""
    count = round(_RAMP_S / _RAMP_STEP_S)
    return tuple((i * _RAMP_STEP_S, speed * (i + 1) / (count + 1)) for i in range(count + 1))
