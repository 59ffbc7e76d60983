"""Motions of the workbench's own twin, for the half of the bank that is its easier one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.bank.courses import RATE_HZ, TIP, Course, Job
from workbench.errors import InputError
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.schemas import ShapeFile
from workbench.sim import EFFECTS, Condition, Simulation, make_robot, simulate_all
from workbench.timeseries import TimeSeries

__all__ = ["TwinGenerator"]


class TwinGenerator:
    """Makes motions with the twin.

    Args:
        shape: of the strip.
        threads: of the simulation; 0 takes all cores.
    """

    def __init__(self, shape: ShapeFile, threads: int = 1) -> None:
        self.shape, self.threads = shape, threads

    def motions(self, jobs: Sequence[Job]) -> list[TimeSeries]:
        """Return the motions asked for.

        Raises:
            ValueError: when an effect is not in the twin's library, or the robot does not stand.
        """
        for job in jobs:
            lacking = [name for name in job.effects if name not in EFFECTS]
            if lacking:
                raise ValueError(
                    f"the twin has no effect {lacking[0]!r}; let the rod make the case"
                )
        asked = [
            (make_robot(job.values, self.shape, effects=_plain(job.effects)), _asked(job.course))
            for job in jobs
        ]
        try:
            done = simulate_all(asked, self.threads)
        except InputError as error:
            raise ValueError(str(error)) from error
        return [_series(one) for one in done]


def _plain(effects: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    return {name: dict(values) for name, values in effects.items()}


def _asked(course: Course) -> Condition:
    """Return the twin's condition; each sample's speed is the mean of the lagging motor's."""
    count = round(course.duration * RATE_HZ) + 1
    times = np.arange(count + 1) / RATE_HZ
    angle, before = np.zeros(count + 1), 0.0
    for begin, speed in course.steps:
        since = np.maximum(times - begin, 0.0)
        angle += (speed - before) * (since + course.lag * np.expm1(-since / course.lag))
        before = speed
    return Condition(
        course.mode,
        np.diff(angle) * RATE_HZ,
        course.start_angle,
        pull=course.pull,
        height=course.height,
    )


def _series(done: Simulation) -> TimeSeries:
    motion = done.motion
    if done.outcome == "diverged":
        raise ValueError(f"the twin diverged at {motion.times[-1]:.3f} s")
    tip = motion[PITCH] + sum(motion[name] for name in motion.names if name.startswith("hinge_"))
    names = (*FOOT, PITCH, *TOP, *ROTOR, ROTOR_ANGLE)
    columns = {name: motion[name] for name in names}
    return TimeSeries.of(motion.times, columns | {TIP: tip - tip[0]})
