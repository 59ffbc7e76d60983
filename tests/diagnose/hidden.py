"""Runs of a robot that has something its model lacks, as the cameras would have seen them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.commanding import commanded_speed
from workbench.fit import MeasuredRun
from workbench.modes import Role
from workbench.motion import FOOT, ROTOR_ANGLE, TOP, Mode
from workbench.schemas import ModelFile, ShapeFile, load_model, load_shape
from workbench.sim import Condition, Robot, make_robot, sample_times, simulate_all
from workbench.timeseries import TimeSeries

__all__ = ["DOCUMENT", "MODEL", "SHAPE", "SWEEP", "Asked", "runs_of", "truth"]

DOCUMENT = load_model("thesis", Path())
MODEL: ModelFile = DOCUMENT.content
SHAPE: ShapeFile = load_shape("thesis-initial", Path()).content
NOISE_M, ARM_M = 3e-4, 0.035
REST_S, LAG_S = 1.0, 0.05
START_S, PULL_SHARE = 2e-3, 0.01
BASE = ("hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping")


class Asked(NamedTuple):
    """One run: a speed [rad/s], a pull [N] or a height [m] by its mode."""

    mode: Mode
    value: float
    seconds: float = 8.0
    role: Role = "train"


SWEEP = (
    Asked("clamped", 7.0),
    Asked("clamped", 11.0),
    Asked("clamped", 13.0),
    Asked("clamped", 15.0),
    Asked("clamped", 17.0),
    Asked("decay", 0.2),
    Asked("decay", 0.8),
    Asked("clamped", 12.0, role="held_out"),
    Asked("decay", 0.4, role="held_out"),
)


def truth(
    seed: int, effects: Mapping[str, Mapping[str, float]], off: float = 0.08, increments: int = 16
) -> Robot:
    """Return a robot with effects, stiffness and damping off by a share at random."""
    rng = np.random.default_rng([seed, 1])
    values = MODEL.values()
    for name in BASE:
        values[name] *= 1 + off * rng.uniform(-1, 1)
    return make_robot(values, SHAPE, increments, effects)


def runs_of(robot: Robot, seed: int, asked: Sequence[Asked] = SWEEP) -> list[MeasuredRun]:
    """Return measured runs with white noise; starts and pulls are known roughly only."""
    rng = np.random.default_rng([seed, 2])
    done = simulate_all([(robot, _condition(one)) for one in asked])
    found = []
    for one, result in zip(asked, done, strict=True):
        motion = result.motion.select([*FOOT, *TOP, ROTOR_ANGLE])
        deviation = np.array([NOISE_M] * 6 + [NOISE_M / ARM_M])
        values = motion.values + deviation * rng.standard_normal(motion.values.shape)
        late = rng.normal(0, START_S)
        seen = TimeSeries(motion.times - late, values, motion.names, motion.valid)
        seen = seen.between(-np.inf, one.seconds - 0.1)
        name = f"{one.mode}_{one.value:g}"
        driven = one.mode in ("clamped", "hop")
        told = one.value * (1 + rng.normal(0, PULL_SHARE))
        found.append(
            MeasuredRun(
                name, one.mode, seen, ((0.0, one.value),) if driven else (),
                pull=told if one.mode == "decay" else 0.0,
                height=told if one.mode == "drop" else 0.0, role=one.role,
            )
        )  # fmt: skip
    return found


def _condition(one: Asked) -> Condition:
    times = sample_times(one.seconds)
    if one.mode in ("clamped", "hop"):
        return Condition(
            one.mode, commanded_speed(times, ((0.0, one.value),), 1.0, LAG_S), rest=REST_S
        )
    still = np.zeros(len(times))
    pull, height = (one.value, 0.0) if one.mode == "decay" else (0.0, one.value)
    return Condition(one.mode, still, rest=REST_S, pull=pull, height=height)
