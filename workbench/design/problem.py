"""One design problem: which robot, driven how, may change in what, to become better at what."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.design.bendable import LEAST_RADIUS_M, BendableStrip
from workbench.design.goals import GOALS, Goal
from workbench.design.uncertainty import Departure, Uncertainty
from workbench.design.variables import ANGLES, BOUNDS, SPEED, Bounds, Varied, make_space
from workbench.errors import InputError
from workbench.optimize import Space
from workbench.schemas import ModelFile, ShapeFile
from workbench.sim import LIMITS, Condition, Robot, make_robot, sample_times

__all__ = ["START_ANGLE_RAD", "Problem"]

START_ANGLE_RAD = np.pi / 2
"""Where the rotor begins: hanging below T, where it comes to rest by itself."""


@dataclass(frozen=True)
class Problem:
    """What is searched for.

    The motor turns at its speed from time zero on, as the feed-forward speed control of the thesis
    does (appendix A.3); the thesis states no ramp and no start angle of the rotor.

    Args:
        model: of the robot; what is varied begins at its values.
        shape: where the search begins; its state says of which angles the candidates are.
        omega: speed of the rotor [rad/s].
        duration: of a hop [s].
        goals: one, or two for a Pareto front.
        bounds: of the angles.
        varied: variables beside the angles.
        uncertainty: what a robust search averages over; None takes the model's robot alone.
        thickness: of the strip [m]; by default the shape's, 0 where it states none.
        least_radius: the tightest bend that is allowed [m].
    """

    model: ModelFile
    shape: ShapeFile
    omega: float = 17.0
    duration: float = 10.0
    goals: tuple[Goal, ...] = (GOALS["distance"],)
    bounds: Bounds = field(default_factory=lambda: BOUNDS["thesis"])
    varied: tuple[Varied, ...] = ()
    uncertainty: Uncertainty | None = None
    thickness: float | None = None
    least_radius: float = LEAST_RADIUS_M

    def __post_init__(self) -> None:
        """Refuse a speed or a duration that cannot be simulated."""
        fastest = LIMITS["speed"].value
        if not abs(self.omega) <= fastest:
            raise InputError(
                f"omega {self.omega:g} rad/s is outside -{fastest:g} to {fastest:g} rad/s"
            )
        if not 0.1 <= self.duration <= 600:
            raise InputError(f"a hop of {self.duration:g} s is not possible; it is 0.1 to 600 s")

    @cached_property
    def space(self) -> Space:
        """What is searched, from the shape on."""
        stated = self.model.values() | {SPEED: self.omega}
        return make_space(self.bounds, self.shape.angles, self.varied, stated)

    @property
    def strip(self) -> BendableStrip:
        """What can be bent and can stand."""
        thickness = self.shape.thickness if self.thickness is None else self.thickness
        return BendableStrip(self.shape.length, thickness or 0.0, self.least_radius)

    @property
    def identity(self) -> str:
        """What distinguishes this problem from every other: its main numbers, and a hash of all."""
        about = {
            "model": self.model.model_dump(mode="json"),
            "shape": self.shape.model_dump(mode="json", exclude={"name", "source"}),
            "goals": [goal.name for goal in self.goals],
            "uncertainty": repr(self.uncertainty),
            "strip": repr(self.strip),
        }
        digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()[:12]
        return f"{self.words}, {digest}"

    @property
    def words(self) -> str:
        """The main numbers of this problem, as people read them."""
        goals = "+".join(goal.name for goal in self.goals)
        robust = ", robust" if self.uncertainty else ""
        return f"{goals} in {self.duration:g} s at {self.omega:g} rad/s{robust}"

    def numbers(self, candidate: NDArray[np.float64]) -> Mapping[str, float]:
        """Return a candidate's variables beside the angles, and the speed, by name.

        Args:
            candidate: (d,) the variables of the space [SI].
        """
        values = dict(zip(self.space.names, map(float, candidate), strict=True))
        return {SPEED: self.omega} | {k: v for k, v in values.items() if k not in ANGLES}

    def robot(self, candidate: NDArray[np.float64]) -> Robot:
        """Return the robot of a candidate; it moves in the hopping plane.

        Args:
            candidate: (d,) the variables of the space, angles [rad] first [SI].
        """
        values = self.model.values()
        values |= {k: v for k, v in self.numbers(candidate).items() if k != SPEED}
        made = make_robot(values, self.shape, self.model.increments, self.model.quantities())
        angles = tuple(float(a) for a in candidate[: len(ANGLES)])
        return replace(made, angles=angles, planar=True)

    def condition(
        self, candidate: NDArray[np.float64], departure: Departure | None = None
    ) -> Condition:
        """Return what a candidate is put through, speed and start angle off by a departure's.

        Args:
            candidate: (d,) the variables of the space [SI].
            departure: from what is stated; none where left out.
        """
        speed, angle = self.numbers(candidate)[SPEED], START_ANGLE_RAD
        if departure is not None:
            speed, angle = speed + departure.omega, angle + departure.turned
        return Condition("hop", np.full(len(sample_times(self.duration)), speed), angle)
