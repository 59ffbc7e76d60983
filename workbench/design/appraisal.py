"""A design in numbers: its shape as in the thesis' table of section 6.1, how it rings, how it hops.

The search itself asks for none of these; a report and the experiments do, of a few designs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.design.bendable import beam_points
from workbench.design.goals import GOALS, Hop
from workbench.design.problem import START_ANGLE_RAD, Problem
from workbench.shape import Metrics, bend_radii, curve, metrics
from workbench.sim import Robot, applied, linear_modes, settle, simulate, unloaded
from workbench.timeseries import TimeSeries

__all__ = ["Appraisal", "ClampedResonances", "appraise", "resonances"]


class ClampedResonances(NamedTuple):
    """The two slowest natural frequencies of the clamped robot under its own weight.

    The rotor counts as a point mass at T. The thesis read its zeta_L off a simulated ring-down.

    Args:
        zeta_T_hz: the torsional mode, T rocks back and forth.
        zeta_L_hz: the longitudinal mode, T swings up and down.
    """

    zeta_T_hz: float
    zeta_L_hz: float


@dataclass(frozen=True)
class Appraisal:
    """What a design is.

    Args:
        free: the free strip's curve, (N + 1, 2) as x, z from the root [m].
        standing: the beam of the robot at rest, (N + 1, 2), x from the foot's centre [m].
        free_metrics: of the free strip.
        standing_metrics: of the robot at rest.
        tightest_m: least radius of curvature of the free strip [m].
        resonances: clamped.
        outcome: of the hop.
        values: name -> value of every goal, empty where the hop did not complete.
        motion: of the hop.
    """

    free: NDArray[np.float64]
    standing: NDArray[np.float64]
    free_metrics: Metrics
    standing_metrics: Metrics
    tightest_m: float
    resonances: ClampedResonances
    outcome: str
    values: dict[str, float]
    motion: TimeSeries

    @property
    def numbers(self) -> dict[str, float]:
        """Return the numbers of shape and ringing under names with units."""
        free, standing = self.free_metrics, self.standing_metrics
        return {
            **free._asdict(),
            "standing_L0_m": standing.L0_m,
            "standing_dh_m": standing.dh_m,
            "standing_e": standing.e,
            "tightest_radius_m": self.tightest_m,
            **self.resonances._asdict(),
        }


def appraise(problem: Problem, candidate: NDArray[np.float64]) -> Appraisal:
    """Return what a candidate of a problem is; it hops once, as its model's robot.

    Args:
        problem: whose candidate it is.
        candidate: (d,) the variables of its space [SI].

    Raises:
        InputError: when the robot does not stand.
    """
    robot = problem.robot(candidate)
    strip = unloaded(applied(robot))
    points = curve(strip.angles, strip.length)
    model, data = settle(strip, "free", START_ANGLE_RAD)
    standing = beam_points(model, data) - data.body("foot").xpos[[0, 2]]
    result = simulate(robot, problem.condition(candidate))
    hop = Hop(robot, result, problem.duration)
    done = result.outcome == "completed"
    return Appraisal(
        free=points,
        standing=standing,
        free_metrics=metrics(points),
        standing_metrics=metrics(standing),
        tightest_m=float(bend_radii(strip.angles, strip.length).min()),
        resonances=resonances(robot),
        outcome=result.outcome,
        values={name: goal.value(hop) for name, goal in GOALS.items()} if done else {},
        motion=result.motion,
    )


def resonances(robot: Robot) -> ClampedResonances:
    """Return how the clamped robot rings.

    Raises:
        InputError: when the robot does not stand.
    """
    slowest = linear_modes(robot, count=2)
    return ClampedResonances(*(mode.hz for mode in slowest))
