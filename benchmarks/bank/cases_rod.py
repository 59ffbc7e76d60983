"""Motions of the independent engine, in the workbench's channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.bank.courses import TIP, Job
from benchmarks.bank.rod import Motion, Rod
from benchmarks.bank.rod_effects import perform
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries

__all__ = ["RodGenerator"]


class RodGenerator:
    """Makes motions with the rod.

    Args:
        angles: the listed ones of the free strip [rad].
        length: of the strip [m].
    """

    def __init__(self, angles: tuple[float, ...], length: float) -> None:
        self.angles, self.length = angles, length

    def motions(self, jobs: Sequence[Job]) -> list[TimeSeries]:
        """Return the motions asked for."""
        return [
            _series(perform(Rod(job.values, self.angles, self.length), job.effects, job.course))
            for job in jobs
        ]


def _series(motion: Motion) -> TimeSeries:
    columns = {PITCH: motion.pitch, ROTOR_ANGLE: motion.rotor_angle}
    for names, path in ((FOOT, motion.foot), (TOP, motion.top), (ROTOR, motion.rotor)):
        columns |= {names[0]: path[:, 0], names[1]: np.zeros(len(path)), names[2]: path[:, 1]}
    tip = motion.pitch + motion.tip
    return TimeSeries.of(motion.times, columns | {TIP: tip - tip[0]})
