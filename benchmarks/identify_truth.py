"""Measured runs of a robot whose parameters are known: what a fit is asked to find.

Made with the twin and numpy alone; nothing that fits has a hand in it. The motor lags behind its
command, the cameras see every point with noise, nobody knows the start to better than a few
milliseconds nor the pull to better than a percent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from workbench.motion import FOOT, ROTOR, TOP, Mode, position
from workbench.schemas import ModelFile, ShapeFile, load_model, load_shape
from workbench.sim import (
    SAMPLE_RATE_HZ,
    Condition,
    Robot,
    make_robot,
    sample_times,
    simulate_all,
    staircase,
)
from workbench.timeseries import TimeSeries

__all__ = [
    "NAMES",
    "PULLS_N",
    "SPEEDS_RAD_S",
    "Take",
    "Truth",
    "commanded",
    "drawn",
    "driven_by",
    "robot_with",
    "taken",
    "thesis_files",
]

NAMES: tuple[str, ...] = ("hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping")
SPEEDS_RAD_S = (7.0, 11.0, 13.0, 15.0, 17.0)
PULLS_N = (0.2, 0.4, 0.8)
OFF = 0.3  # a parameter lies within this share of its stated value
NOISE_M = 3e-4  # of every coordinate of every point
START_S = 2e-3  # deviation of the instant that is taken for time zero
PULL_SHARE = 0.01
LAG_S = 0.05  # of the motor behind its command
RAMP_S, RAMP_STEPS, FIRST_STEP = 0.5, 5, 0.1
REST_S = 0.5
_FINE = 16  # the motor is computed in steps of this part of a sample


@dataclass(frozen=True)
class Truth:
    """What a fit is asked to find.

    Args:
        values: of the four parameters, SI.
        robot: that has them.
        seed: of the draw.
    """

    values: Mapping[str, float]
    robot: Robot
    seed: int


@dataclass(frozen=True, eq=False)
class Take:
    """What was seen of one run, and what is written down about it.

    Args:
        name: of the run.
        mode: clamped or decay.
        times: (n,) zero is what was taken for the start [s].
        top: (n, 3) T as the cameras saw it [m].
        rotor: (n, 3) [m].
        foot: (n, 3) [m].
        steps: (time [s], commanded speed [rad/s]).
        pull: as written down [N].
        late: how much later time zero is than the true start [s].
        true_pull: [N].
    """

    name: str
    mode: Mode
    times: NDArray[np.float64]
    top: NDArray[np.float64]
    rotor: NDArray[np.float64]
    foot: NDArray[np.float64]
    steps: tuple[tuple[float, float], ...]
    pull: float
    late: float
    true_pull: float


def thesis_files() -> tuple[ModelFile, ShapeFile]:
    """Return the model and shape that every fit starts from."""
    here = Path()
    return load_model("thesis", here).content, load_shape("thesis-initial", here).content


def drawn(seed: int, increments: int = 16) -> Truth:
    """Draw a robot whose four parameters are off by up to 30 % from the stated ones."""
    model, shape = thesis_files()
    share = np.random.default_rng([seed, 0]).uniform(1 - OFF, 1 + OFF, len(NAMES))
    stated = model.values()
    values = {name: stated[name] * float(s) for name, s in zip(NAMES, share, strict=True)}
    return Truth(values, make_robot(dict(stated) | values, shape, increments), seed)


def commanded(speed: float) -> tuple[tuple[float, float], ...]:
    """Return the steps of the ramp to a speed, (time [s], speed [rad/s])."""
    parts = np.arange(RAMP_STEPS + 1) / RAMP_STEPS
    return tuple(
        (float(RAMP_S * p), float(speed * (FIRST_STEP + (1 - FIRST_STEP) * p))) for p in parts
    )


def driven_by(steps: Sequence[tuple[float, float]], seconds: float) -> NDArray[np.float64]:
    """Return the speed of a lagging motor, its mean over each sample, (n,) [rad/s]."""
    count = len(sample_times(seconds))
    step = 1 / (_FINE * SAMPLE_RATE_HZ)
    fine = np.arange(count * _FINE, dtype=np.float64) * step
    asked = staircase(fine, steps)
    keep = np.exp(-step / LAG_S)
    speed = np.asarray(lfilter([1 - keep], [1, -keep], asked))
    return speed.reshape(count, _FINE).mean(axis=1)


def taken(
    truth: Truth,
    seconds: float = 10.0,
    speeds: Sequence[float] = SPEEDS_RAD_S,
    pulls: Sequence[float] = PULLS_N,
    threads: int = 0,
) -> list[Take]:
    """Run and film the truth: a clamped run a speed and a ring-down a pull.

    Args:
        truth: the robot.
        seconds: of each run.
        speeds: of the clamped runs [rad/s].
        pulls: of the ring-downs [N].
        threads: of the simulation; 0 takes all cores.

    Raises:
        RuntimeError: when a run does not last, so that no laboratory would have kept it.
    """
    rng = np.random.default_rng([truth.seed, 1])
    still = np.zeros(len(sample_times(seconds)))
    asked = [(f"clamped {speed:g}", commanded(speed), 0.0) for speed in speeds]
    asked += [(f"decay {pull:g}", (), pull) for pull in pulls]
    conditions = [
        Condition("clamped", driven_by(steps, seconds), rest=REST_S)
        if steps
        else Condition("decay", still, rest=REST_S, pull=pull)
        for _, steps, pull in asked
    ]
    results = simulate_all([(truth.robot, condition) for condition in conditions], threads)
    takes = []
    for (name, steps, pull), result in zip(asked, results, strict=True):
        if result.outcome != "completed":
            raise RuntimeError(f"seed {truth.seed}: the robot {result.outcome} in run {name}")
        takes.append(_filmed(result.motion, name, steps, pull, rng))
    return takes


def _filmed(
    motion: TimeSeries,
    name: str,
    steps: tuple[tuple[float, float], ...],
    pull: float,
    rng: np.random.Generator,
) -> Take:
    """Return a motion as cameras and paper have it."""
    top, rotor, foot = (
        position(motion, point) + rng.normal(0, NOISE_M, (len(motion), 3))
        for point in (TOP, ROTOR, FOOT)
    )
    late = float(rng.normal(0, START_S))
    stated = pull * (1 + PULL_SHARE * float(rng.standard_normal()))
    mode: Mode = "clamped" if steps else "decay"
    return Take(name, mode, motion.times - late, top, rotor, foot, steps, stated, late, pull)


def robot_with(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with some of its values changed."""
    return replace(robot, values=dict(robot.values) | dict(values))
