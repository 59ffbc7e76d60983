"""Runs of the hopping robot that nobody has made, as a model that may be true would show them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.investigate.proposed import ProposedRun
from workbench.motion import DRIVEN, FOOT, PITCH, ROTOR_ANGLE, TOP, Mode, time_zero
from workbench.sim import Condition, Robot, attempt_all, sample_times, staircase

__all__ = ["HypotheticalRun", "hypothetical_runs"]

_RAMP_S, _RAMP_STEP_S = 0.5, 0.1
"""How a supply reaches its voltage where a protocol says nothing else."""
_REST_S = 0.6
_AFTER_S = 0.2  # that is simulated beyond a run: its time zero is found afterwards
_ANGLES = (ROTOR_ANGLE, PITCH)


@dataclass(frozen=True, eq=False)
class HypotheticalRun(MeasuredRun):
    """A run without noise that is weighed by the noise which the bench would add.

    Args:
        sigmas: channel -> standard deviation of that noise [m] or [rad].
    """

    sigmas: Mapping[str, float] = field(default_factory=dict[str, float])

    def noise(self, channels: Sequence[str] = ()) -> NDArray[np.float64]:
        """Return the standard deviation of the noise in each channel, (c,) [m] or [rad]."""
        return np.array([self.sigmas[name] for name in channels or self.channels])


def hypothetical_runs(
    robot: Robot, trials: Sequence[ProposedRun], measured: Sequence[MeasuredRun], threads: int = 0
) -> list[MeasuredRun | None]:
    """Return trials as a robot would show them; None where it falls or cannot be simulated.

    Args:
        robot: that is taken as true.
        trials: that could be made.
        measured: runs that exist; their noise and start angle are taken over.
        threads: 0 takes all cores.
    """
    start = measured[0].start_angle
    sigmas = _sigmas(measured, robot.values["rotor_radius"])
    names = [*FOOT, *TOP, ROTOR_ANGLE]
    if any(PITCH in run.motion for run in measured):
        names.append(PITCH)
    conditions = [_condition(trial, start) for trial in trials]
    found: list[MeasuredRun | None] = []
    for trial, one, made in zip(
        trials, conditions, attempt_all([(robot, c) for c in conditions], threads), strict=True
    ):
        if isinstance(made, InputError) or made.outcome != "completed":
            found.append(None)
            continue
        zero = time_zero(one.mode, made.motion) or 0.0
        motion = made.motion.select(names).shifted(-zero).between(-np.inf, trial.duration)
        found.append(HypotheticalRun(
            f"{trial.mode} {trial.amount:g}", one.mode, motion, _steps(trial), start,
            one.pull, one.height, sigmas=sigmas,
        ))  # fmt: skip
    return found


def _condition(trial: ProposedRun, start_angle: float) -> Condition:
    mode, times = cast(Mode, trial.mode), sample_times(trial.duration + _AFTER_S)
    speed = staircase(times, _steps(trial)) if mode in DRIVEN else np.zeros(len(times))
    pull = trial.amount if mode == "decay" else 0.0
    height = trial.amount if mode == "drop" else 0.0
    return Condition(mode, speed, start_angle, _REST_S, pull, height)


def _steps(trial: ProposedRun) -> tuple[tuple[float, float], ...]:
    """Return (time [s], speed [rad/s]) in even steps up to a trial's speed; none if undriven."""
    if trial.mode not in DRIVEN:
        return ()
    count = round(_RAMP_S / _RAMP_STEP_S)
    return tuple((i * _RAMP_STEP_S, trial.amount * (i + 1) / (count + 1)) for i in range(count + 1))


def _sigmas(measured: Sequence[MeasuredRun], radius: float) -> dict[str, float]:
    """Return each channel's noise, [m] or [rad]: the median run's, or the worst of its unit.

    An angle that no run has seen is that of two places a rotor's radius [m] apart.
    """
    seen: dict[str, list[float]] = {}
    for run in measured:
        channels = [*run.channels, *([PITCH] if PITCH in run.motion else [])]
        for name, sigma in zip(channels, run.noise(channels), strict=True):
            seen.setdefault(name, []).append(float(sigma))
    known = {name: float(np.median(values)) for name, values in seen.items()}
    place = max(v for name, v in known.items() if name not in _ANGLES)
    angle = max((v for name, v in known.items() if name in _ANGLES), default=place / radius)
    every = (*FOOT, *TOP, *_ANGLES)
    return {name: known.get(name, angle if name in _ANGLES else place) for name in every}
