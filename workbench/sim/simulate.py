"""Run robots from rest and record their motion at 120 Hz, one or many at once on all cores.

`simulate_all` is the one way to run: a single simulation is a batch of one, so that a result does
not depend on the others. Between two samples only compiled code runs; the interpreter sets the
drive's command and takes the sample.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence, Sized
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Literal, NamedTuple, TypeVar

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim.checks import require_stable, require_valid
from workbench.sim.condition import Condition
from workbench.sim.drive import Drive
from workbench.sim.effects.apply import applied, driven, observed
from workbench.sim.equilibrium import FALLEN_M, lift, settle, unloaded
from workbench.sim.robot import SAMPLE_RATE_HZ, Robot
from workbench.sim.samples import ENERGY, SampleRecorder, Samples, motion_of
from workbench.sim.stepper import Stepper
from workbench.timeseries import TimeSeries

__all__ = [
    "Outcome",
    "Precheck",
    "Simulation",
    "at_rest",
    "attempt_all",
    "keep_engine_quiet",
    "parallel_map",
    "simulate",
    "simulate_all",
]

Outcome = Literal["completed", "fell", "diverged"]

Job = tuple[Robot, Condition]

Precheck = Callable[[mujoco.MjModel, mujoco.MjData], None]
"""Checks a model at rest, before its first step; raises InputError to refuse it."""

J = TypeVar("J")
R = TypeVar("R")

_MOST_AT_ONCE = 8
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_CURRENT = int(mujoco.mjtStage.mjSTAGE_VEL)


@dataclass(frozen=True)
class Simulation:
    """Result of one simulation.

    Args:
        outcome: `fell` when T went below 0.05 m, `diverged` when the integration did; the motion
            then ends with the last valid state.
        motion: channels of `workbench.motion`, hinge angles, ground forces, contact and power,
            120 Hz, positions against the foot at rest. Time zero is where the command begins.
        sink_m: depth of the foot's centre below the floor at rest.
        weight_N: of the whole robot.
    """

    outcome: Outcome
    motion: TimeSeries
    sink_m: float
    weight_N: float


def simulate(robot: Robot, condition: Condition) -> Simulation:
    """Simulate one robot from rest.

    Raises:
        InputError: when it cannot be built, does not stand or is refused by `checks`.
    """
    return simulate_all([(robot, condition)], threads=1)[0]


def simulate_all(jobs: Sequence[Job], threads: int = 0) -> list[Simulation]:
    """Simulate many robots, each from rest; the results are in the order of the jobs.

    Every thread takes a few jobs at a time, so that the interpreter works on some while compiled
    code steps others.

    Args:
        jobs: any mix of robots and conditions.
        threads: 0 takes all cores. Results do not depend on it, bit for bit.

    Raises:
        InputError: when one of them cannot be built, does not stand or is refused by `checks`.
    """
    return _on_threads(_simulate_chunk, jobs, threads)


def attempt_all(
    jobs: Sequence[Job], threads: int = 0, precheck: Precheck | None = None
) -> list[Simulation | InputError]:
    """Simulate many robots as `simulate_all` does; a refused one has its error as result.

    Args:
        jobs: any mix of robots and conditions.
        threads: 0 takes all cores.
        precheck: of each model at rest before its first step; raises InputError to refuse it.
    """
    return _on_threads(partial(_attempt_chunk, precheck=precheck), jobs, threads)


def _on_threads(
    work: Callable[[Sequence[Job]], Sequence[R]], jobs: Sequence[Job], threads: int
) -> list[R]:
    """Give threads a few jobs at a time; the results are in the order of the jobs."""
    threads = threads or os.cpu_count() or 1
    size = min(_MOST_AT_ONCE, max(1, -(-len(jobs) // threads)))
    chunks = [jobs[i : i + size] for i in range(0, len(jobs), size)]
    return [result for done in parallel_map(work, chunks, threads) for result in done]


def parallel_map(work: Callable[[J], R], jobs: Iterable[J], threads: int = 0) -> list[R]:
    """Return the results of a function for each job, on all cores unless `threads` is given.

    Jobs are taken on the calling thread, all of them at once: the first begin before the last is
    made.
    """
    threads = threads or os.cpu_count() or 1
    if threads == 1 or (isinstance(jobs, Sized) and len(jobs) < 2):
        return [work(job) for job in jobs]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, jobs))


def _simulate_chunk(jobs: Sequence[Job]) -> list[Simulation]:
    """Simulate on the calling thread; the first refused job ends it."""
    return _step([_prepared(job) for job in jobs])


def _attempt_chunk(jobs: Sequence[Job], precheck: Precheck | None) -> list[Simulation | InputError]:
    """Simulate the jobs that are not refused, on the calling thread."""
    tried = [_prepared_or_refused(job, precheck) for job in jobs]
    done = iter(_step([one for one in tried if isinstance(one, _Prepared)]))
    return [next(done) if isinstance(one, _Prepared) else one for one in tried]


class _Prepared(NamedTuple):
    """A job with effects applied, its model and data at rest; `asked` is the robot before them."""

    asked: Robot
    robot: Robot
    condition: Condition
    model: mujoco.MjModel
    data: mujoco.MjData


def _prepared(job: Job) -> _Prepared:
    asked, condition = job
    robot, driven_by = applied(asked, bool(np.any(condition.command))), driven(condition, asked)
    return _Prepared(asked, robot, driven_by, *at_rest(robot, driven_by))


def _prepared_or_refused(job: Job, precheck: Precheck | None) -> _Prepared | InputError:
    try:
        ready = _prepared(job)
        if precheck is not None:
            precheck(ready.model, ready.data)
    except InputError as refusal:
        return refusal
    return ready


def _step(jobs: Sequence[_Prepared]) -> list[Simulation]:
    """Step to the end, jobs of equal layout together."""
    groups: dict[tuple[Drive, bool, int, int, int, int, int], list[int]] = {}
    for i, (_, robot, condition, model, _) in enumerate(jobs):
        sizes = (model.nq, model.nu, model.nbody, len(condition.command))
        layout = (condition.drive, condition.energy, *sizes, robot.steps_per_sample)
        groups.setdefault(layout, []).append(i)
    done: dict[int, Simulation] = {}
    for (*_, steps), members in groups.items():
        recorder, valid = _stepped(
            [(jobs[i].model, jobs[i].data) for i in members],
            np.array([jobs[i].condition.command for i in members]),
            steps,
        )
        for row, i in enumerate(members):
            result = _result(jobs[i], recorder.samples(row), int(valid[row]))
            done[i] = replace(result, motion=observed(result.motion, jobs[i].asked))
    return [done[i] for i in range(len(jobs))]


def at_rest(robot: Robot, condition: Condition) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return model and data at time zero."""
    require_valid(robot, condition)
    model, data = _rest(unloaded(robot), condition)
    if condition.energy:
        model.opt.enableflags |= ENERGY
    require_stable(model, data)
    return model, data


def _rest(free: Robot, condition: Condition) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return model and data of a free strip at time zero."""
    angle, drive = condition.start_angle, condition.drive
    if condition.mode != "drop":
        pull = (condition.pull, condition.pull_up) if condition.mode == "decay" else (0.0, 0.0)
        return settle(free, condition.foot, angle, pull, drive)
    _, held = settle(free, "fixed", angle, drive=drive)
    model, data = settle(free, "free", angle, drive=drive)
    lift(model, data, held, condition.height)
    return model, data


def _stepped(
    starts: Sequence[tuple[mujoco.MjModel, mujoco.MjData]], command: NDArray[np.float64], steps: int
) -> tuple[SampleRecorder, NDArray[np.int_]]:
    """Step a group of equal layout; return the samples and how many of them are valid.

    Args:
        starts: model and data at time zero.
        command: (n, samples) in the unit of their drive.
        steps: of the engine from one sample to the next.
    """
    keep_engine_quiet()
    model = starts[0][0]
    batch = Batch(model, nsim=len(starts), nthread=1, persistent=True)
    batch.set_models([m for m, _ in starts])
    for row, (own, data) in enumerate(starts):
        mujoco.mj_getState(own, data, batch.state[row], _STATE)
    batch.forward(stage=_CURRENT)
    stepper, control = Stepper(batch, [m for m, _ in starts]), batch.bind("ctrl")
    recorder = SampleRecorder(batch, stepper.torque, command.shape[1])
    recorder.take(0)
    valid = np.full(len(starts), command.shape[1])
    for k in range(1, command.shape[1]):
        control[:] = command[:, k - 1, None]
        stepper.step(steps)
        recorder.take(k)
        # after divergence the engine restarts from zero: the rest is another motion
        valid[stepper.broken] = np.minimum(valid[stepper.broken], k)
    return recorder, valid


@cache
def keep_engine_quiet() -> None:
    """Stop the engine from writing a log file into the user's folder; `Outcome` reports faults."""
    config = mujoco.MjLogConfig.get()
    config.logto_file = config.logto_console = False
    config.set()


def _result(job: _Prepared, samples: Samples, valid: int) -> Simulation:
    """Turn samples into a motion that ends where the robot fell or the integration diverged."""
    _, robot, condition, model, data = job
    sink = -float(data.body("foot").xpos[2]) if condition.mode == "hop" else 0.0
    motion = motion_of(robot, model, samples, rest=condition.rest)
    count, top = len(samples.top), samples.top[:, 2]
    fallen = np.flatnonzero(top[:valid] < FALLEN_M)
    outcome: Outcome = "completed" if valid == count else "diverged"
    if len(fallen):
        outcome, valid = "fell", int(fallen[0])
    if valid < count:
        motion = motion.between(-np.inf, (max(valid, 1) - 1) / SAMPLE_RATE_HZ)
    weight = robot.values["gravity"] * float(model.body_mass.sum())
    return Simulation(outcome, motion, sink, weight)
