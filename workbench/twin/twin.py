"""The twin of a run: the simulation of exactly what was asked of the robot that the cameras saw."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import scipy

from workbench.errors import InputError
from workbench.motion import DRIVEN, RELEASED, Mode, seen_median, summarize_release, time_zero
from workbench.schemas import ModelFile, ShapeFile
from workbench.sim import (
    Condition,
    Robot,
    applied,
    make_robot,
    require_stable,
    sample_times,
    settle,
    simulate,
    staircase,
    unloaded,
)
from workbench.timeseries import TimeSeries
from workbench.tracking import Track

__all__ = ["Command", "Release", "check_twin", "find_release", "make_twin", "robot_of"]

_LEAST_REST_S = 0.6  # what the estimators of time zero need to know the rest
_MOST_REST_S = 5.0
_AFTER_S = 0.5
_FIRST_TRY: dict[Mode, tuple[float, float]] = {"decay": (0.05, 0.2), "drop": (0.005, 0.02)}
"""Pulls [N] and heights [m] from which the search for the measured one begins."""
_WITHIN: dict[Mode, float] = {"decay": 1e-4, "drop": 1e-5}
_ROUNDS = 20
_SIGMA = 1.483  # standard deviation of a normal distribution over its median deviation
_ALIKE = 5  # neighbours of a track that is low-passed at 25 Hz say about the same


@dataclass(frozen=True)
class Command:
    """What the motor was commanded.

    Args:
        steps: (time since the output came on [s], rotor speed [rad/s]), ending with speed 0; empty
            where nothing drove the robot.
        duration: time with the output on, or after the release [s].
    """

    steps: tuple[tuple[float, float], ...]
    duration: float


class Release(NamedTuple):
    """From where a robot was let go.

    Args:
        pull: force on T, forward [N]; zero in a drop.
        height: of the foot above the floor [m]; zero in a decay.
        uncertainty: standard error of what was found in the data; None when it was given.
        pull_up: force on T, upward [N].
    """

    pull: float = 0.0
    height: float = 0.0
    uncertainty: float | None = None
    pull_up: float = 0.0


def check_twin(model: ModelFile, shape: ShapeFile, modes: Iterable[Mode]) -> None:
    """Find out before anything is switched whether this robot can be simulated.

    Raises:
        InputError: when it cannot be built, does not stand or its step is too long, or when one of
            its effects is unknown.
    """
    for mode in sorted(set(modes)):
        foot = Condition(mode, np.zeros(1)).foot
        require_stable(*settle(unloaded(applied(robot_of(model, shape))), foot, np.pi / 2))


def make_twin(
    mode: Mode,
    model: ModelFile,
    shape: ShapeFile,
    command: Command,
    track: Track,
    release: Release | None = None,
) -> tuple[TimeSeries, str]:
    """Simulate exactly the run that was measured.

    The twin gets the same commands, or the same release, and starts with the rotor where the track
    saw it; its time zero is found by the same estimator as the track's.

    Returns:
        The motion with its time zero, and the simulation's outcome.

    Raises:
        InputError: when the model has unknown effects or does not stand.
    """
    condition = _condition(mode, command, track, release or Release())
    result = simulate(robot_of(model, shape), condition)
    zero = time_zero(mode, result.motion) or 0.0
    return result.motion.shifted(-zero), result.outcome


def find_release(
    mode: Mode, model: ModelFile, shape: ShapeFile, command: Command, track: Track
) -> Release:
    """Return the pull or the height with which the twin is displaced as far as the robot was.

    Twin and track are asked by the same estimator, so that what a swing's size does to its centre,
    and how deep the foot sinks into the ground, count on both sides.

    Raises:
        InputError: when the displacement is not seen, or the model cannot be displaced so far.
    """
    robot, start = robot_of(model, shape), _condition(mode, command, track, Release())
    what, unit = ("pull", "N") if mode == "decay" else ("height", "m")
    wanted = summarize_release(track.motion, mode, command.duration).displacement_m
    if not np.isfinite(wanted):
        raise InputError(f"the {what} before the release cannot be found from this take; give it")

    def displacement(value: float) -> float:
        return _displacement(robot, replace(start, **{what: value}), command.duration)

    first, second = _FIRST_TRY[mode]
    slope = (displacement(second) - displacement(first)) / (second - first)
    found = scipy.optimize.root_scalar(
        lambda value: displacement(value) - wanted,
        method="secant",
        x0=second,
        x1=first + (wanted - displacement(first)) / slope,
        xtol=_WITHIN[mode],
        maxiter=_ROUNDS,
    )
    if not found.converged or not np.isfinite(found.root):
        raise InputError(
            f"no {what} displaces this model by the {1000 * wanted:.1f} mm that were measured; "
            f"give the {what} [{unit}], or check model and shape"
        )
    uncertainty = _scatter(mode, track) / abs(slope)
    if mode == "decay":
        return Release(pull=float(found.root), uncertainty=uncertainty)
    return Release(height=float(found.root), uncertainty=uncertainty)


def _displacement(robot: Robot, condition: Condition, duration: float) -> float:
    """Return how far the twin is displaced before its release [m]."""
    motion = simulate(robot, condition).motion
    zero = time_zero(condition.mode, motion) or 0.0
    return summarize_release(motion.shifted(-zero), condition.mode, duration).displacement_m


def _scatter(mode: Mode, track: Track) -> float:
    """Return the standard error of the held place [m], from its scatter before the release."""
    channel = RELEASED[mode][0 if mode == "decay" else 2]
    rest = track.motion.between(-_MOST_REST_S, 0.0)
    seen = rest[channel][rest.validity(channel)]
    alone = max(1.0, len(seen) / _ALIKE)
    return _SIGMA * seen_median(np.abs(seen - seen_median(seen))) / float(np.sqrt(alone))


def _condition(mode: Mode, command: Command, track: Track, release: Release) -> Condition:
    rest = float(np.clip(track.rest_s, _LEAST_REST_S, _MOST_REST_S))
    times = sample_times(command.duration + _AFTER_S)
    speed = staircase(times, command.steps) if mode in DRIVEN else np.zeros(len(times))
    return Condition(
        mode, speed, track.start_angle_rad, rest, release.pull, release.height,
        pull_up=release.pull_up,
    )  # fmt: skip


def robot_of(
    model: ModelFile,
    shape: ShapeFile,
    changed: Mapping[str, float] = MappingProxyType({}),
    increments: int | None = None,
) -> Robot:
    """Return the robot of a model and a shape, with the effects that the model has.

    Args:
        model: of the robot.
        shape: of its beam.
        changed: values that replace the model's own, by name, SI.
        increments: of the simulated beam; the model's own where left out.

    Raises:
        InputError: when the model has no value of a name.
    """
    values = model.values() | dict(changed)
    return make_robot(values, shape, increments or model.increments, model.quantities())
