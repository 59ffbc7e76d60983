"""Simulate robots in as short steps as their kind needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco

from workbench.errors import InputError
from workbench.motion import Mode
from workbench.sim import Condition, Robot, attempt_all, simulate
from workbench.sim.robot import hinge_name
from workbench.timeseries import TimeSeries

__all__ = ["Job", "Stepping", "coarsened"]

Job = tuple[Robot, Condition]

_MOST_STEPS = 136  # of the engine, a sample
_COARSE_STEPS = 6
_COARSE_HOP_STEPS = 17
_SLUGGISH_KG_M2 = 1e-5  # derivatives change by 1 % (`tests/diagnose/test_hopper_steps.py`)


class Stepping:
    """Simulates, and remembers how many steps each kind of robot needs.

    A kind that once needed shorter steps keeps them: what is compared should not differ by its
    steps.

    Args:
        threads: of the simulation; 0 takes all cores.
    """

    def __init__(self, threads: int = 0) -> None:
        self.threads = threads
        self._known: dict[tuple[object, ...], int | None] = {}

    def motions(self, jobs: Sequence[Job]) -> list[TimeSeries | None]:
        """Simulate all, in shorter steps where a robot is too stiff; None where one cannot be."""
        motions: list[TimeSeries | None] = [None] * len(jobs)
        waiting = list(range(len(jobs)))
        while waiting:
            steps = [self._steps_of(jobs[i]) for i in waiting]
            ready = [
                (replace(jobs[i][0], steps_per_sample=n), jobs[i][1])
                for i, n in zip(waiting, steps, strict=True) if n
            ]  # fmt: skip
            done = iter(attempt_all(ready, self.threads))
            refused = []
            for i, n in zip(waiting, steps, strict=True):
                result = next(done) if n else None
                if isinstance(result, InputError):
                    refused.append(i)
                elif result is not None:
                    motions[i] = result.motion
            waiting = self._in_shorter_steps(jobs, refused)
        return motions

    def stepped(self, robot: Robot, condition: Condition) -> Job | None:
        """Return a robot in as many steps as its kind needs; None where none would do."""
        steps = self._steps_of((robot, condition))
        return None if steps is None else (replace(robot, steps_per_sample=steps), condition)

    def _steps_of(self, job: Job) -> int | None:
        """Return steps a sample that a kind of robot can be simulated in; its first one tells."""
        kind = _kind(job)
        if kind not in self._known:
            self._known[kind] = _steps_for(job)
        return self._known[kind]

    def _in_shorter_steps(self, jobs: Sequence[Job], refused: Sequence[int]) -> list[int]:
        """Shorten the steps of kinds that were refused; return the jobs to be tried again."""
        again = []
        shortened: set[tuple[object, ...]] = set()
        for i in refused:
            kind = _kind(jobs[i])
            if kind not in shortened:
                before, needed = self._known[kind], _steps_for(jobs[i])
                if needed is None or before is None or needed <= before:
                    continue  # no step helps this one
                self._known[kind] = needed
                shortened.add(kind)
            again.append(i)
        return again


def coarsened(robot: Robot, mode: Mode) -> Robot:
    """Return a robot whose motion changes with its numbers as that of the one given.

    With its foot held it takes six steps a sample. What forbids such steps are the light increments
    alone, which ring at kilohertz: each hinge gets a moment of inertia of its own (mass scaling, as
    in explicit finite elements), which the modes that cameras see hardly feel. A hop takes steps
    twice as long: its landings do not allow for more, nor for other hinges.

    Args:
        robot: as it is compared.
        mode: of the run.
    """
    if mode not in ("clamped", "decay"):
        return replace(robot, steps_per_sample=_COARSE_HOP_STEPS)
    return replace(
        robot, steps_per_sample=_COARSE_STEPS, edits=(*robot.edits, _make_hinges_sluggish)
    )


def _make_hinges_sluggish(spec: mujoco.MjSpec, robot: Robot) -> None:
    for k, hinge in enumerate(robot.hinges):
        if hinge.stiffness is not None:
            spec.joint(hinge_name(k)).armature = _SLUGGISH_KG_M2


def _kind(job: Job) -> tuple[object, ...]:
    """Return what robots have in common that are simulated in the same steps."""
    return (*job[0].effects, job[0].steps_per_sample)


def _steps_for(job: Job) -> int | None:
    """Return steps of the engine a sample that a robot can be simulated in, None where none do."""
    robot, condition = job
    steps = robot.steps_per_sample
    while steps <= _MOST_STEPS:
        try:
            tried = replace(robot, steps_per_sample=steps)
            simulate(tried, replace(condition, command=condition.command[:1]))
        except InputError:
            steps *= 2
        else:
            return steps
    return None
