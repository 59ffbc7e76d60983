"""One simulation without a bench, and what it came to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from workbench.errors import InputError
from workbench.modes import DRIVEN, Mode
from workbench.quantities import numbers_in_words

if TYPE_CHECKING:
    import pyarrow as pa

    from workbench.design import DistanceDraws
    from workbench.sim import Condition, Robot, Simulation
    from workbench.timeseries import TimeSeries

__all__ = ["Simulated", "simulate"]

_REST_S = 0.6
_DURATIONS_S = (0.1, 600.0)


@dataclass(frozen=True, eq=False, repr=False)
class Simulated:
    """What a simulation came to.

    Args:
        robot: that was simulated.
        condition: what it was put through.
        duration_s: from time zero to the end [s].
        result: motion and outcome.
        tolerances: of the model's friction coefficients, for `spread`.
    """

    robot: Robot
    condition: Condition
    duration_s: float
    result: Simulation
    tolerances: Mapping[str, float]

    @property
    def outcome(self) -> str:
        """How it ended: `completed`, `fell` or `diverged`."""
        return self.result.outcome

    @property
    def series(self) -> TimeSeries:
        """Motion at 120 Hz, places in m against the foot at rest, angles in rad, forces in N."""
        return self.result.motion

    def table(self) -> pa.Table:
        """Return the series as an Arrow table with `time_s`; `.to_pandas()` makes a frame of it."""
        return self.series.table()

    @cached_property
    def summary(self) -> dict[str, float]:
        """What the robot did; units are in the names: `distance_m`, `hop_height_m`, `hops`, ..."""
        from workbench.motion import summarize, summarize_clamped, summarize_release
        from workbench.sim import gait

        mode, motion = self.condition.mode, self.series
        if mode not in DRIVEN:
            return summarize_release(motion, mode, self.duration_s).as_json()
        did = summarize_clamped if mode == "clamped" else summarize
        hops = gait(self.result, self.duration_s)._asdict()
        return did(motion, self.duration_s).as_json() | hops

    def spread(self, draws: int = 16) -> DistanceDraws:
        """Return how a hop's distance spreads over start angle, friction and speed.

        Args:
            draws: hops that are simulated, each with other values within the tolerances.

        Raises:
            InputError: when this is no hop, or less than two draws are asked for.
        """
        from workbench.design import draw_distances

        if self.condition.mode != "hop" or draws < 2:
            raise InputError(
                f"mode {self.condition.mode!r}, {draws} draws: only a hop's distance spreads, over "
                "at least 2 draws"
            )
        (found,) = draw_distances([(self.robot, self.condition)], self.tolerances, draws)
        return found

    def __repr__(self) -> str:
        """Return it in three lines: what it was, what it came to, what there is to look at."""
        return (
            f"Simulated {self.condition.mode} of {self.duration_s:g} s: {self.outcome}\n"
            f"  {numbers_in_words(self.summary)}\n  series: {self.series!r}"
        )


def simulate(
    omega: float = 17.0,
    duration: float = 10.0,
    model: str | Path = "thesis",
    shape: str | Path = "thesis-initial",
    mode: Mode = "hop",
    *,
    parameters: Mapping[str, float] = MappingProxyType({}),
    start_angle: float = math.pi / 2,
    pull: float = 0.39,
    height: float = 0.02,
    increments: int | None = None,
    slope: float = 0.0,
) -> Simulated:
    """Simulate one run.

    Args:
        omega: speed of the rotor [rad/s], in modes `hop` and `clamped`; negative turns back.
        duration: from time zero to the end [s], 0.1 to 600.
        model: built-in name, or path of a model file.
        shape: built-in name, or path of a shape file.
        mode: `hop`, `clamped`, `decay` or `drop`.
        parameters: values that replace the model's own, by name [SI].
        start_angle: of the rotor at rest, from forward towards down [rad].
        pull: force on T before its release [N], in mode `decay`.
        height: of the fall [m], in mode `drop`.
        increments: of the simulated beam; the model's own where left out.
        slope: of the floor, rising forward [rad].

    Raises:
        InputError: when a name does not exist, a number is outside of what is possible, or the
            robot does not stand.

    Example:
        >>> hop = wb.simulate(omega=17, parameters={"top_mass": 0.090})
        >>> hop.summary["distance_m"]
    """
    import numpy as np

    from workbench.design import tolerances_of
    from workbench.schemas import load_model, load_shape
    from workbench.sim import Condition, sample_times
    from workbench.sim import simulate as simulate_robot
    from workbench.twin import robot_of

    _require(omega, duration)
    file = load_model(str(model), Path()).content
    beam = load_shape(str(shape), Path()).content
    robot = replace(robot_of(file, beam, parameters, increments), slope=slope)
    command = np.full(len(sample_times(duration)), omega if mode in DRIVEN else 0.0)
    condition = Condition(mode, command, start_angle, _REST_S, pull, height)
    result = simulate_robot(robot, condition)
    return Simulated(robot, condition, duration, result, tolerances_of(file))


def _require(omega: float, duration: float) -> None:
    from workbench.sim import LIMITS

    fastest, (shortest, longest) = LIMITS["speed"].value, _DURATIONS_S
    if not abs(omega) <= fastest:
        raise InputError(f"omega {omega:g} rad/s is outside -{fastest:g} to {fastest:g} rad/s")
    if not shortest <= duration <= longest:
        raise InputError(f"duration {duration:g} s is outside {shortest:g} to {longest:g} s")
