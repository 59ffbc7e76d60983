"""Runs of a known robot, as the cameras would have seen them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.commanding import commanded_speed
from workbench.fit import MeasuredRun
from workbench.modes import Role
from workbench.motion import FOOT, ROTOR_ANGLE, TOP
from workbench.schemas import ModelFile, ShapeFile, load_model, load_shape
from workbench.sim import Condition, make_robot, sample_times, simulate
from workbench.timeseries import TimeSeries

MODEL: ModelFile = load_model("thesis", Path()).content
SHAPE: ShapeFile = load_shape("thesis-initial", Path()).content
NOISE_M = 3e-4
REST_S = 0.5
LAG_S = 0.05
ARM_M = 0.035


def changed(**values: float) -> ModelFile:
    """Return the thesis' model with other values."""
    own = {
        name: getattr(MODEL.parameters, name).model_copy(update={"value": value})
        for name, value in values.items()
    }
    parameters = MODEL.parameters.model_copy(update=own)
    return MODEL.model_copy(update={"parameters": parameters})


def known(model: ModelFile, *uncertain: str) -> ModelFile:
    """Return the model with tolerances of zero, but for some numbers."""
    own = {
        name: parameter.model_copy(update={"tolerance": 0.0})
        for name, parameter in dict(model.parameters).items()
        if name not in uncertain
    }
    return model.model_copy(update={"parameters": model.parameters.model_copy(update=own)})


def driven(
    model: ModelFile, mode: str, omega: float, seconds: float, role: Role = "train"
) -> MeasuredRun:
    """Return a run at a constant speed [rad/s]."""
    steps = ((0.0, omega),)
    command = commanded_speed(sample_times(seconds), steps, 1.0, LAG_S)
    condition = Condition("hop" if mode == "hop" else "clamped", command, rest=REST_S)
    return MeasuredRun(
        f"{mode}_{omega:g}", condition.mode, seen(model, condition), steps, role=role
    )


def dropped(model: ModelFile, height: float, seconds: float, role: Role = "train") -> MeasuredRun:
    """Return a fall from a height [m]."""
    still = np.zeros(len(sample_times(seconds)))
    condition = Condition("drop", still, rest=REST_S, height=height)
    name = f"drop_{1000 * height:g}mm"
    return MeasuredRun(name, "drop", seen(model, condition), height=height, role=role)


def released(model: ModelFile, pull: float, seconds: float, increments: int = 16) -> MeasuredRun:
    """Return a ring-down after a pull [N]."""
    still = np.zeros(len(sample_times(seconds)))
    condition = Condition("decay", still, rest=REST_S, pull=pull)
    motion = seen(model, condition, increments)
    return MeasuredRun(f"decay_{pull:g}N", "decay", motion, pull=pull)


def seen(model: ModelFile, condition: Condition, increments: int = 16) -> TimeSeries:
    """Return the motion with white noise; the rotor's angle has that of its arm."""
    motion = simulate(make_robot(model.values(), SHAPE, increments), condition).motion
    motion = motion.select([*FOOT, *TOP, ROTOR_ANGLE])
    deviation = np.array([NOISE_M] * 6 + [NOISE_M / ARM_M])
    noise = deviation * np.random.default_rng(7).standard_normal(motion.values.shape)
    return TimeSeries(motion.times, motion.values + noise, motion.names, motion.valid)
