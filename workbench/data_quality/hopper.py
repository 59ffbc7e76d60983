"""Runs of the hopping robot that are not what they are said to be, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.data_quality.bodies import Expected, body_faults
from workbench.data_quality.drive import drive_faults
from workbench.data_quality.facts import Fault
from workbench.data_quality.releases import release_faults
from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, position
from workbench.sim import Condition, Robot, at_rest, sample_times, simulate_all, staircase

__all__ = ["hopper_faults"]

_WEAK_N = 0.1
_HOPPED_S = 1.0  # of a hop, until a foot that is free has moved


def hopper_faults(robot: Robot, runs: Sequence[MeasuredRun]) -> list[Fault]:
    """Return which runs are not what they are said to be.

    Args:
        robot: as stated.
        runs: as measured.
    """
    drive = drive_faults(runs)
    misdriven = {fault.run for fault in drive}
    ways = _foot_ways(robot, runs, misdriven)
    expected = [
        Expected(_top(robot, run, run.pull), _top(robot, run, 0.0), ways.get(k, 0.0))
        for k, run in enumerate(runs)
    ]
    bodies = body_faults(runs, expected)
    faulty = {
        fault.run for fault in bodies
    }  # whose drive or release would only show the same again
    releases = release_faults(runs, expected, [k for k in range(len(runs)) if k not in faulty])
    return [*bodies, *(fault for fault in drive if fault.run not in faulty), *releases]


def _top(robot: Robot, run: MeasuredRun, pull: float) -> NDArray[np.float64]:
    """Return where T is before time zero, from the foot, (2,) [m].

    A pull that no model of this robot can bear is taken in proportion to a weak one.
    """
    still = Condition(run.mode, np.zeros(2), run.start_angle, pull=pull, height=run.height)
    try:
        _, data = at_rest(robot, still)
    except InputError:
        if pull <= _WEAK_N:
            raise
        free, weak = (_top(robot, run, part) for part in (0.0, _WEAK_N))
        return free + (weak - free) * pull / _WEAK_N
    return np.asarray((data.body("top").xpos - data.body("foot").xpos)[[0, 2]])


def _foot_ways(robot: Robot, runs: Sequence[MeasuredRun], misdriven: set[int]) -> dict[int, float]:
    """Return the root mean square way of each hop's foot from its start [m]."""
    times = sample_times(_HOPPED_S)
    hops = {
        k: Condition("hop", staircase(times, run.steps), run.start_angle)
        for k, run in enumerate(runs)
        if run.mode == "hop" and k not in misdriven
    }
    paths = (
        position(one.motion, FOOT)[:, [0, 2]]
        for one in simulate_all([(robot, condition) for condition in hops.values()])
    )
    return {
        k: float(np.sqrt(np.mean(np.sum((path - path[0]) ** 2, axis=1))))
        for k, path in zip(hops, paths, strict=True)
    }
