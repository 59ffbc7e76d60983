"""What a search improves. A new goal is one function of a finished run and one line in `GOALS`."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from workbench.design.stability import tipping_margin
from workbench.errors import require_named
from workbench.motion import summarize
from workbench.sim import Robot, Simulation, gait

__all__ = ["FITNESS_OFFSET", "GOALS", "PENALTY", "Goal", "Hop", "goal_named"]

FITNESS_OFFSET = 100.0
"""a of eq. 5.1: fitness is a less the goal's value."""
PENALTY = FITNESS_OFFSET + 2.0
"""Fitness of a fall, a crash, a shape that cannot be bent (section 5.2.1 of the thesis)."""


class Hop(NamedTuple):
    """A hop to its end.

    Args:
        robot: that hopped.
        simulation: which completed.
        duration: of the drive [s].
    """

    robot: Robot
    simulation: Simulation
    duration: float


class Goal(NamedTuple):
    """Something to make greater.

    Args:
        name: as on the command line.
        column: name of its value in tables and files, with the unit.
        value: of a hop, more is better.
        scale: what counts as much as one metre of distance, so that the penalty is as far from
            good values for every goal.
        meaning: in people's words.
    """

    name: str
    column: str
    value: Callable[[Hop], float]
    scale: float
    meaning: str

    def fitness(self, value: float) -> float:
        """Return what a search makes less."""
        return FITNESS_OFFSET - value / self.scale

    def value_of(self, fitness: float) -> float:
        """Return the value that has this fitness."""
        return (FITNESS_OFFSET - fitness) * self.scale


def _distance(hop: Hop) -> float:
    return summarize(hop.simulation.motion, hop.duration).distance_m


def _height(hop: Hop) -> float:
    return summarize(hop.simulation.motion, hop.duration).hop_height_m


_ROUNDING = 1e-9  # a cost of transport that a robot at rest may seem to have


def _efficiency(hop: Hop) -> float:
    """Return 1 / cost of transport: unlike the cost it is finite for a robot that stays."""
    cost = gait(hop.simulation, hop.duration).cost_of_transport
    return 1 / cost if cost > _ROUNDING else 0.0  # NaN where it did not travel forward


def _stability(hop: Hop) -> float:
    return tipping_margin(hop.robot, hop.simulation.motion)


GOALS = {
    goal.name: goal
    for goal in (
        Goal("distance", "distance_m", _distance, 1.0, "forward travel of the foot, x_10s"),
        Goal("height", "hop_height_m", _height, 0.05, "usual height of a hop"),
        Goal(
            "cost",
            "weight_times_way_per_work",
            _efficiency,
            5.0,
            "inverse of the cost of transport",
        ),
        Goal("stability", "tipping_margin_rad", _stability, 0.5, "least angle to tipping over"),
    )
}
"""Name -> goal."""


def goal_named(name: str) -> Goal:
    """Return a goal.

    Raises:
        InputError: with the names that exist.
    """
    require_named("goal", name, GOALS)
    return GOALS[name]
