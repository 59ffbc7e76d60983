"""What a deviation costs in distance: target and beam simulated, each over the angles' doubt."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import summarize
from workbench.photo import AsBent
from workbench.schemas import ModelFile, ShapeFile
from workbench.sim import LIMITS, Condition, Robot, Simulation, make_robot, sample_times
from workbench.sim import simulate_all as simulate_robots

__all__ = ["Cost", "simulate_cost"]

Array = NDArray[np.float64]

_START_ANGLE = math.pi / 2  # the rotor hangs


@dataclass(frozen=True, eq=False)
class Cost:
    """How far target and beam go.

    Args:
        omega: of the rotor [rad/s].
        duration: of the drive [s].
        target: distance of the target [m].
        bent: distance of the beam [m].
        around_target: (n,) distances of shapes as far from the target as the beam's angles are in
            doubt [m].
        around_bent: (n,) the same around the beam [m].
        falls: how many of all of them fell; their distance ends there.
    """

    omega: float
    duration: float
    target: float
    bent: float
    around_target: Array
    around_bent: Array
    falls: int

    @property
    def change(self) -> float:
        """Return beam less target: of the means over the doubt, if there is one [m]."""
        if not len(self.around_bent):
            return self.bent - self.target
        return float(np.mean(self.around_bent) - np.mean(self.around_target))

    @property
    def change_error(self) -> float | None:
        """Return the change's standard error; None without a doubt to draw from [m]."""
        if len(self.around_bent) < 2:
            return None
        difference = self.around_bent - self.around_target
        return float(np.std(difference, ddof=1) / math.sqrt(len(difference)))


def simulate_cost(
    bent: AsBent,
    target: ShapeFile,
    model: ModelFile,
    omega: float = 17.0,
    duration: float = 10.0,
    samples: int = 12,
    seed: int = 1,
) -> Cost:
    """Simulate target and beam, and both again with angles drawn from the beam's covariance.

    Args:
        bent: as it was read.
        target: of the free strip.
        model: of the robot.
        omega: speed of the rotor [rad/s].
        duration: of the drive [s].
        samples: how many draws; none where the angles' doubt is not known.
        seed: of the draws.

    Raises:
        InputError: when the speed is none that can be simulated or a robot does not stand.
    """
    fastest = LIMITS["speed"].value
    if not abs(omega) <= fastest:
        raise InputError(f"omega {omega:g} rad/s is outside -{fastest:g} to {fastest:g} rad/s")
    doubt = _draws(bent, samples, seed)
    count = len(doubt)
    robot = make_robot(model.values(), target, model.increments, model.quantities())
    middle = [np.array(target.angles), bent.angles]
    angles = [*middle, *(middle[0] + doubt), *(middle[1] + doubt)]
    condition = Condition("hop", np.full(len(sample_times(duration)), omega), _START_ANGLE)
    done = simulate_robots([(_with(robot, one), condition) for one in angles])
    distances = np.array([_distance(one, duration) for one in done])
    return Cost(
        omega, duration, float(distances[0]), float(distances[1]),
        distances[2 : 2 + count], distances[2 + count :],
        sum(one.outcome != "completed" for one in done),
    )  # fmt: skip


def _draws(bent: AsBent, samples: int, seed: int) -> Array:
    """Return by how much the angles may be off, (samples, 16) [rad]; none where it is unknown."""
    if bent.covariance is None:
        return np.zeros((0, len(bent.angles)))
    nothing = np.zeros(len(bent.angles))
    return np.random.default_rng(seed).multivariate_normal(nothing, bent.covariance, samples)


def _with(robot: Robot, angles: Array) -> Robot:
    return replace(robot, angles=tuple(float(a) for a in angles))


def _distance(simulation: Simulation, duration: float) -> float:
    """Return how far the foot came [m]; of a robot that fell, until then."""
    end = min(duration, float(simulation.motion.times[-1]))
    return summarize(simulation.motion, end).distance_m
