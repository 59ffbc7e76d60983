"""What the robot that is built may be instead of the one that was designed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim import Robot

__all__ = ["BEND_ERROR_RAD", "SPEED_ERROR_RAD_S", "Departure", "Uncertainty", "altered"]

SPEED_ERROR_RAD_S = 0.3
"""How far the speed is off, one standard deviation: 2 % at 17 rad/s, without an encoder."""
BEND_ERROR_RAD = float(np.radians(1.0))
"""How far each joint is bent off its angle, one standard deviation: by hand against a print."""


class Departure(NamedTuple):
    """How one robot differs from the one designed.

    Args:
        values: by which each parameter of the model is off, SI.
        omega: by which the speed is off [rad/s].
        angles: (16,) by which each joint is bent off [rad].
        turned: by which the rotor stands off its start angle [rad].
    """

    values: Mapping[str, float]
    omega: float
    angles: NDArray[np.float64]
    turned: float = 0.0


@dataclass(frozen=True)
class Uncertainty:
    """Departures drawn once, by a Latin hypercube: every candidate meets the same ones.

    With common random numbers a candidate is not better for having been lucky. A parameter of the
    model lies anywhere within its tolerance, the rotor's start angle anywhere within its own; speed
    and joints are normal.

    Args:
        tolerances: of the model's parameters, SI; half the width of an even distribution.
        draws: how many robots are simulated for one candidate.
        seed: of the drawing.
        speed_error: standard deviation [rad/s].
        bend_error: standard deviation of every joint [rad].
        weight: how many standard deviations of the fitness are added to its mean.
        turned_by: half the width of the rotor's start angle [rad]; nobody turns it by hand before a
            run, so that it may stand anywhere.
    """

    tolerances: Mapping[str, float]
    draws: int = 8
    seed: int = 0
    speed_error: float = SPEED_ERROR_RAD_S
    bend_error: float = BEND_ERROR_RAD
    weight: float = 1.0
    turned_by: float = float(np.pi)

    def __post_init__(self) -> None:
        """Refuse fewer than two draws: they have no spread."""
        if self.draws < 2:
            raise InputError(f"{self.draws} draws have no spread; take at least 2")

    @cached_property
    def departures(self) -> tuple[Departure, ...]:
        """Return the draws."""
        names, joints = list(self.tolerances), 16
        cube = scipy.stats.qmc.LatinHypercube(
            len(names) + 2 + joints, rng=np.random.default_rng(self.seed)
        )
        drawn = cube.random(self.draws)
        even, normal = (
            2 * drawn[:, : len(names)] - 1,
            scipy.stats.norm.ppf(drawn[:, len(names) : -1]),
        )
        turned = self.turned_by * (2 * drawn[:, -1] - 1)
        return tuple(
            Departure(
                {n: float(u) * self.tolerances[n] for n, u in zip(names, row, strict=True)},
                float(rest[0]) * self.speed_error,
                np.asarray(rest[1:], dtype=np.float64) * self.bend_error,
                float(angle),
            )
            for row, rest, angle in zip(even, normal, turned, strict=True)
        )

    def fitness(self, each: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return mean plus spread of the fitness of the draws, (goals,) [unit of each goal].

        Fitness is less where a goal is met better, so the spread counts against a candidate.

        Args:
            each: (draws, goals) [unit of each goal].
        """
        return each.mean(axis=0) + self.weight * each.std(axis=0, ddof=1)


def altered(robot: Robot, departure: Departure) -> Robot:
    """Return the robot as it may turn out.

    Sticking friction stays at least sliding friction, and what is above zero stays above a tenth of
    what was stated: the tolerances are wide enough to say otherwise.
    """
    values = dict(robot.values)
    for name, off in departure.values.items():
        least = 0.1 * values[name] if values[name] > 0 else -np.inf
        values[name] = float(max(values[name] + off, least))
    values["friction_stick"] = max(values["friction_stick"], values["friction_slide"])
    angles = tuple(float(a) for a in np.asarray(robot.angles) + departure.angles)
    return replace(robot, values=values, angles=angles)
