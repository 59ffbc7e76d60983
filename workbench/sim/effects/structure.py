"""Effects of structure: how the strip and its joint to the foot bend."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.sim.beam_laws import add_law
from workbench.sim.effects.effect import Effect, Quantity, Values
from workbench.sim.effects.scaling import scaled, turn_ratio
from workbench.sim.robot import Robot, hinge_name

__all__ = ["EFFECTS"]

HINGE_STIFFNESS = Effect(
    name="hinge_stiffness",
    group="structure",
    sentence="the beam's hinges are {share:stiffer|softer} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-0.9, high=9.0, tolerance=0.1, step=5e-4),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=(
        "root_stiffness",
        "local_stiffness_loss",
        "top_mass",
        "beam_discretisation",
        "length_scale",
    ),
    separated_by="the ratio of the two lowest frequencies; weighing",
    alter=lambda robot, values: scaled(robot, values["share"], "hinge_stiffness"),
)

ROOT_STIFFNESS = Effect(
    name="root_stiffness",
    group="structure",
    sentence=(
        "the joint of beam and foot is {share:stiffer|softer} than the model says by {share:size}"
    ),
    quantities=(Quantity("share", "1", low=-0.9, high=9.0, tolerance=0.1, step=2e-3),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "local_stiffness_loss", "beam_discretisation"),
    separated_by="a marker where the beam leaves the foot; the ratio of the two lowest frequencies",
    alter=lambda robot, values: scaled(robot, values["share"], "root_stiffness"),
)


def _hinge_cubic_stiffness(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    for k, hinge in enumerate(robot.hinges[1:], start=1):
        if hinge.stiffness is not None:
            spec.joint(hinge_name(k)).stiffness[2] += values["k3"] / turn_ratio(robot, hinge) ** 3


HINGE_CUBIC_STIFFNESS = Effect(
    name="hinge_cubic_stiffness",
    group="structure",
    sentence="the beam {k3:stiffens|softens} as it bends, with a cubic term of {k3} in every hinge",
    quantities=(Quantity("k3", "N m/rad^3", low=-2e3, high=2e4, tolerance=30.0, step=1.0),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("root_play", "hinge_quadratic_damping"),
    separated_by="ring-downs at three amplitudes: the frequency moves with amplitude squared",
    build=_hinge_cubic_stiffness,
)
"""The beam stiffens with its bend: a cubic term on every hinge but the foot joint.

torque = -k a - k3 a^3, a from the hinge's rest angle; MuJoCo's own stiffness polynomial.
"""

ROOT_PLAY = Effect(
    name="root_play",
    group="structure",
    sentence="the joint of beam and foot has play: it turns freely by {gap} either way",
    quantities=(Quantity("gap", "rad", low=0.0, high=0.1, tolerance=0.001, step=0.0001),),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_cubic_stiffness", "hinge_coulomb_friction", "rest_shape_drift"),
    separated_by="ring-downs of small amplitude: the frequency falls; a slow pull both ways",
    build=lambda spec, _, values: add_law(spec, {"root_gap": values["gap"]}),
)
"""The foot joint has play: it turns freely within a gap before its spring acts.

torque = -k dead(a), zero within the gap either way and k times what is beyond it. In the gap the
robot topples to one side, so it may rest at either end of it. The joint's damping stays.
"""

_PARTS = ("near_foot", "middle", "near_top")


def _local_stiffness_loss(spec: mujoco.MjSpec, robot: Robot, values: Values) -> None:
    softer = np.array([values[part] / (1 - values[part]) for part in _PARTS])
    for k, hinge in enumerate(robot.hinges):
        if hinge.stiffness is None:
            continue
        compliance = (
            1 / hinge.stiffness + _overlap(robot, k) @ softer / robot.values["hinge_stiffness"]
        )
        spec.joint(hinge_name(k)).stiffness[0] = 1 / compliance


def _overlap(robot: Robot, k: int) -> NDArray[np.float64]:
    """Return the overlap of a hinge's strip with each third of the beam [listed increments], (3,).

    The strip that bends begins half an increment from the foot and ends as far from T (`beam`).
    """
    listed = len(robot.angles)
    cell = listed / robot.increments
    edges = np.linspace(0.5, listed - 0.5, len(_PARTS) + 1)
    ends = np.clip([max(k - 0.5, 0.0) * cell, (k + 0.5) * cell], edges[:-1, None], edges[1:, None])
    return ends[:, 1] - ends[:, 0]


LOCAL_STIFFNESS_LOSS = Effect(
    name="local_stiffness_loss",
    group="structure",
    sentence=(
        "the beam lost stiffness: {near_foot} in the third near the foot, {middle} in the middle, "
        "{near_top} near the top"
    ),
    quantities=tuple(
        Quantity(part, "1", low=-1.0, high=0.95, tolerance=0.05, step=5e-4) for part in _PARTS
    ),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=("hinge_stiffness", "root_stiffness", "rest_shape_drift"),
    separated_by="the ratio of the two lowest frequencies; the beam's shape with a mass hung on T",
    build=_local_stiffness_loss,
)
"""A part of the beam lost stiffness: a crack, a kink, a burnt spot.

Each third of the strip has its own loss, so that a linear screening shows its position; a loss at a
border shows in both thirds. Damping stays. Negative where it is stiffer.
"""


def _rest_shape_drift(robot: Robot, values: Values) -> Robot:
    others = len(robot.angles) - 1
    before = robot.drift or (0.0,) * len(robot.angles)
    change = (values["root"],) + (values["bend"] / others,) * others
    return replace(robot, drift=tuple(a + b for a, b in zip(before, change, strict=True)))


REST_SHAPE_DRIFT = Effect(
    name="rest_shape_drift",
    group="structure",
    sentence="the strip took a set: its root turned by {root}, the rest bent by {bend} in all",
    quantities=(
        Quantity("root", "rad", low=-0.5, high=0.5, tolerance=0.005, step=0.0005),
        Quantity("bend", "rad", low=-0.5, high=0.5, tolerance=0.02, step=5e-4),
    ),
    excited_by=("clamped", "decay", "hop", "drop"),
    confused_with=(
        "ground_slope",
        "camera_tilt",
        "tether",
        "root_play",
        "local_stiffness_loss",
        "marker_offset",
    ),
    separated_by="the free strip on its template before and after; a run in the opposite direction",
    alter=_rest_shape_drift,
)
"""The strip took a set since its shape was listed: its rest angles changed for good.

`root` is the angle of the foot joint, `bend` is spread evenly over the other hinges. A shape that
was listed standing drifts as well: the change is that of the free strip.
"""

EFFECTS = (
    HINGE_STIFFNESS,
    ROOT_STIFFNESS,
    HINGE_CUBIC_STIFFNESS,
    ROOT_PLAY,
    LOCAL_STIFFNESS_LOSS,
    REST_SHAPE_DRIFT,
)
