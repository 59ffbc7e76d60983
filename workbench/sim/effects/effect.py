"""An effect: one named cause that extends the model or the observation.

An effect has quantities, all zero where it is absent, and acts in up to four ways. `alter` changes
the robot's parameters, `build` its MjSpec, `drive` the rotor's command, `observe` the motion as the
cameras see it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import mujoco

from workbench.motion import Mode
from workbench.sim.condition import Condition
from workbench.sim.robot import Robot
from workbench.timeseries import TimeSeries

__all__ = ["Alter", "Build", "Drive", "Effect", "Group", "Observe", "Quantity", "Values"]

Group = Literal[
    "structure", "dissipation", "mass", "drive", "ground", "outside", "sensor", "numerics"
]

Values = Mapping[str, float]
"""Quantity -> value; those that are not given are zero."""

Alter = Callable[[Robot, Values], Robot]
Build = Callable[[mujoco.MjSpec, Robot, Values], None]
Drive = Callable[[Condition, Values], Condition]
Observe = Callable[[TimeSeries, Values], TimeSeries]


@dataclass(frozen=True)
class Quantity:
    """One number of an effect; zero means that the effect is absent.

    Args:
        name: the key in a model file.
        unit: SI.
        low: least that is physically possible.
        high: greatest that is physically possible.
        tolerance: standard deviation of its prior: how large it may be in a careful laboratory.
        step: of finite differences: small enough for a linear response of the motion, large against
            the change by one slip of the foot more or less.
    """

    name: str
    unit: str
    low: float
    high: float
    tolerance: float
    step: float


@dataclass(frozen=True)
class Effect:
    """A named cause.

    Args:
        name: canonical, as in a model file.
        group: what kind of cause it is.
        sentence: for a technician; `{name}` becomes a quantity with its unit, `{name:size}` its
            magnitude, and `{name:heavier|lighter}` the word for its sign.
        quantities: all of them zero where it is absent.
        excited_by: modes of runs in which it shows.
        confused_with: names of effects that look alike.
        separated_by: what separates it from those, in words.
        alter: changes the robot's parameters.
        build: changes the MjSpec of a robot with this effect.
        drive: changes the rotor's command.
        observe: changes the motion as the cameras see it.
    """

    name: str
    group: Group
    sentence: str
    quantities: tuple[Quantity, ...]
    excited_by: tuple[Mode, ...]
    confused_with: tuple[str, ...] = ()
    separated_by: str = ""
    alter: Alter | None = None
    build: Build | None = None
    drive: Drive | None = None
    observe: Observe | None = None
