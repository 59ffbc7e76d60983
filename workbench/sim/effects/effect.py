"""What an effect is: one named cause that extends the model or the observation.

An effect has quantities, all zero where it is absent, and up to four places where it acts. `alter`
changes the robot's numbers, `build` its MjSpec, `drive` what the motor does with its command,
`observe` what the cameras make of the motion.
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
        high: greatest that is.
        tolerance: how large it may well be in a lab that took care; a prior's deviation.
        step: a change that a finite difference may take: small enough for the motion to follow in
            proportion, large beside what one slip of the foot more or less changes.
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
        sentence: what a technician is told; `{name}` stands for a quantity with its unit,
            `{name:size}` for how large it is, and `{name:heavier|lighter}` for the word that its
            sign asks for.
        quantities: all of them zero where it is absent.
        excited_by: modes of runs in which it shows.
        confused_with: names of effects that look alike.
        separated_by: what tells it from those, in words.
        alter: changes the robot's numbers.
        build: changes the MjSpec of a robot with this effect.
        drive: changes what the rotor is told.
        observe: changes what is seen of the motion.
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
